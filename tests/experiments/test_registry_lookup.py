"""Experiments are found by reading, imported on use, and keep the framework's rules."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from toy_experiment import TOY

from vslam_ref.experiments import registry
from vslam_ref.experiments.registry import load, register, summaries
from vslam_ref.support.config import config_to_dict, find_setting, format_value, without_reason
from vslam_ref.support.errors import InputError
from vslam_ref.support.json_text import to_json

IDS = [summary.id for summary in summaries()]


def test_a_registered_experiment_is_listed_and_loaded(toy):
    assert load("toy") is toy
    assert "toy" in [s.id for s in summaries()]
    with pytest.raises(ValueError, match="already taken"):
        register(toy)


def test_an_unknown_id_names_the_nearest(toy):
    with pytest.raises(InputError, match=r"unknown experiment 'tyo' \(did you mean 'toy'\?\); known: .*toy"):
        load("tyo")


def test_listing_imports_no_numbers_and_no_plots():
    code = (
        "import sys; from vslam_ref.experiments.registry import summaries; summaries();"
        "print([m for m in ('numpy', 'scipy', 'matplotlib', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.fixture
def module(tmp_path):
    """A module of a family called ``my``."""
    (tmp_path / "my").mkdir()
    return tmp_path / "my" / "table.py"


def test_a_module_is_read_without_being_imported(module):
    module.write_text(
        'raise SystemExit\nEXPERIMENT = Experiment(id="my-table", title="T", source="S", simulate=f)\n'
    )
    assert registry.read(module) == [("my-table", "T", "S")]
    module.write_text("x = 1\n")
    assert registry.read(module) == []


def test_rows_of_a_table_are_experiments_of_their_own(module):
    module.write_text(
        'EXPERIMENTS = (\n    row(2, id="my-fig2", title="T2", source="S"),\n'
        '    row(3, id="my-fig3", title="T3", source="S"),\n)\n'
    )
    assert registry.read(module) == [("my-fig2", "T2", "S"), ("my-fig3", "T3", "S")]


def test_a_record_that_cannot_be_read_says_what_it_needs(module):
    module.write_text('EXPERIMENT = Experiment(id="my-table", title=TITLE, source="S")\n')
    with pytest.raises(ValueError, match="must give title as literal"):
        registry.read(module)
    module.write_text('EXPERIMENT = Experiment(id="other-table", title="T", source="S")\n')
    with pytest.raises(ValueError, match="belongs in another folder"):
        registry.read(module)


@pytest.mark.parametrize("id", IDS)
def test_the_record_that_was_read_is_the_record_that_runs(id):
    experiment = load(id)
    listed = {s.id: s for s in summaries()}[id]
    assert (experiment.id, experiment.title, experiment.source) == listed


@pytest.mark.parametrize("id", IDS)
def test_every_setting_of_every_experiment_gives_its_reason(id):
    experiment = load(id)
    assert without_reason(experiment.default()) == []
    assert without_reason(experiment.configure(quick=True)) == []


@pytest.mark.parametrize("id", IDS)
def test_every_setting_of_every_experiment_can_be_set_and_written(id):
    experiment = load(id)
    flat = config_to_dict(experiment.default())
    overrides = [f"{key}={format_value(value)}" for key, value in flat.items()]
    assert experiment.configure(overrides=overrides) == experiment.default()
    assert json.loads(to_json(flat)) == flat


@pytest.mark.parametrize("id", IDS)
def test_runs_and_seed_reach_every_experiment_that_draws(id):
    experiment = load(id)
    default = experiment.default()
    for name, changed in (("runs", {"runs": 21}), ("seed", {"seed": 12345})):
        key = find_setting(default, name)
        if key is not None:
            config = experiment.configure(**changed)
            assert config_to_dict(config)[key] == changed[name]
            assert config != default


def test_options_apply_in_their_documented_order():
    config = TOY.configure(quick=True, runs=4, seed=9, overrides=["population=5"])
    assert (config.runs, config.population, config.seed, config.box.side) == (4, 5, 9, 3.0)


def test_a_population_keeps_its_ratio_to_the_sample():
    assert TOY.configure(runs=9).population == 36
    assert TOY.configure(quick=True, runs=3).population == 12


def test_errors_of_settings_name_the_experiment():
    with pytest.raises(InputError, match=r"^toy: unknown setting 'x'"):
        TOY.configure(overrides=["x=1"])


def test_bench_and_experiments_do_not_import_each_other():
    package = Path(registry.__file__).parents[1]
    for room, other in (("bench", "experiments"), ("experiments", "bench")):
        for path in (package / room).rglob("*.py"):
            assert f"vslam_ref.{other}" not in path.read_text(encoding="utf-8"), path
