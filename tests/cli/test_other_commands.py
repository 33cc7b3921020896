"""``list``, ``data``, ``bench`` and ``warm-cache`` print what they write to ``--json``."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import types

import pytest

from vslam_ref import _kernels, cli
from vslam_ref._kernels import _digests
from vslam_ref.commands import bench
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.known import DATA_SETS, LICENCE_CLASSES


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Two search folders; the second holds a complete set, the first an incomplete one of its name."""
    first, second = tmp_path / "first", tmp_path / "second"
    (first / "plaza_range").mkdir(parents=True)
    (second / "plaza_range").mkdir(parents=True)
    for name in catalogue.get("plaza_range").files:
        (second / "plaza_range" / name).write_text("")
    monkeypatch.setenv("VSLAM_REF_DATA", f"{first}{os.pathsep}{os.pathsep}{second}")
    return first, second


def test_a_set_is_found_where_it_is_complete(folders):
    assert catalogue.find("plaza_range") == folders[1] / "plaza_range"
    assert catalogue.require("plaza_range") == folders[1] / "plaza_range"


def test_a_missing_set_says_where_to_get_it(folders):
    assert catalogue.find("bal") is None
    with pytest.raises(ValueError, match=r"data set 'bal' not found in VSLAM_REF_DATA .*get it from \S+"):
        catalogue.require("bal")


def test_no_variable_means_no_sets(monkeypatch):
    monkeypatch.delenv("VSLAM_REF_DATA", raising=False)
    assert catalogue.search_path() == []
    assert catalogue.find("bal") is None


def test_the_table_of_sets_is_complete_and_in_order():
    names = [data_set.name for data_set in DATA_SETS]
    assert names == sorted(set(names))
    for data_set in DATA_SETS:
        assert data_set.licence in LICENCE_CLASSES
        assert all(data_set)


@pytest.mark.skipif("VSLAM_REF_DATA" not in os.environ, reason="VSLAM_REF_DATA is not set")
def test_every_folder_of_the_data_that_is_known_is_complete():
    for root in catalogue.search_path():
        for data_set in DATA_SETS:
            folder = root / data_set.name
            missing = [f for f in data_set.files if folder.is_dir() and not (folder / f).exists()]
            assert missing == [], data_set.name


def test_data_shows_what_is_found(folders, tmp_path, capsys):
    target = tmp_path / "data.json"
    assert cli.main(["data", "--json", str(target)]) == 0
    shown = capsys.readouterr().out
    assert f"found: {folders[1] / 'plaza_range'}" in shown
    assert f"1 of {len(DATA_SETS)} found" in shown
    found = {d["name"]: d["found"] for d in json.loads(target.read_text())["data_sets"]}
    assert found.pop("plaza_range") == str(folders[1] / "plaza_range")
    assert set(found.values()) == {None}


def test_data_shows_the_named_sets_only(folders, capsys):
    assert cli.main(["data", "bal", "plaza_range"]) == 0
    assert "1 of 2 found" in capsys.readouterr().out
    assert cli.main(["data", "balk"]) == 2
    assert "unknown data set 'balk' (did you mean 'bal'?); known: " in capsys.readouterr().err


def test_list_shows_experiments_filters_chapters_and_data(toy, folders, tmp_path, capsys):
    target = tmp_path / "list.json"
    assert cli.main(["list", "--json", str(target)]) == 0
    shown, content = capsys.readouterr().out, json.loads(target.read_text())
    assert toy.id in [e["id"] for e in content["experiments"]]
    assert content["data_sets_found"] == {"plaza_range": str(folders[1] / "plaza_range")}
    for group, key in (("chapters", "title"), ("filters", "name"), ("experiments", "title")):
        assert content[group]
        assert all(entry[key] in shown for entry in content[group])


def test_list_says_how_to_make_data_found(monkeypatch, capsys):
    monkeypatch.delenv("VSLAM_REF_DATA", raising=False)
    assert cli.main(["list"]) == 0
    assert "set VSLAM_REF_DATA" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["list", "data", "bench", "warm-cache"])
def test_a_json_file_in_a_missing_folder_is_refused_before_any_work(command, tmp_path, capsys):
    assert cli.main([command, "--json", str(tmp_path / "missing" / "x.json")]) == 2
    shown = capsys.readouterr()
    assert "does not exist" in shown.err
    assert shown.out == ""


@pytest.fixture
def suite(monkeypatch):
    """A suite of measurements that takes no time."""
    module = types.ModuleType("vslam_ref.bench.filters")
    rows = [{"n": 10, "ours": 1.25, "peer": None}, {"n": 20, "ours": 2.5, "ratio": 3.0}]
    module.run = lambda quick: {"rows": rows, "growth": {"exponent": 1.5}, "quick": quick}
    monkeypatch.setitem(sys.modules, "vslam_ref.bench.filters", module)


def test_bench_prints_a_table_and_writes_the_numbers(suite, tmp_path, capsys):
    target = tmp_path / "bench.json"
    assert cli.main(["bench", "filters", "--quick", "--json", str(target)]) == 0
    lines = [line.split() for line in capsys.readouterr().out.strip().split("\n")]
    assert ["n", "ours", "peer", "ratio"] in lines
    assert ["10", "1.25", "-", "-"] in lines
    assert ["growth.exponent", "1.5"] in lines
    assert json.loads(target.read_text())["filters"]["rows"][1]["ratio"] == 3.0
    assert json.loads(target.read_text())["filters"]["quick"] is True


def test_an_unknown_suite_is_told_before_any_work(suite, capsys):
    assert cli.main(["bench", "filter"]) == 2
    shown = capsys.readouterr()
    told = f"unknown suite 'filter' (did you mean 'filters'?); known: {', '.join(bench.SUITES)}"
    assert shown.err == f"vslam-ref: error: {told}\n"
    assert shown.out == ""


def test_warming_compiles_the_kernels_where_numba_is_in_use(monkeypatch, tmp_path, capsys):
    warmed = []
    monkeypatch.setattr(_kernels, "warm", lambda: warmed.append(1), raising=False)
    monkeypatch.setattr(_kernels, "backend", lambda: "numba")
    target = tmp_path / "w.json"
    assert cli.main(["warm-cache", "--json", str(target)]) == 0
    assert warmed == [1]
    assert "kernels ready after" in capsys.readouterr().out
    assert json.loads(target.read_text())["backend"] == "numba"


def test_the_modules_that_are_warmed_declare_every_twin_by_themselves():
    """In a process of its own: here, other tests have imported everything."""
    code = (
        "import importlib; from vslam_ref import _kernels; from vslam_ref.commands import warm_cache\n"
        "for name in warm_cache.WITH_TWINS: importlib.import_module(name)\n"
        "print(*sorted(twin for _, twin in _kernels.REGISTRY.values()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == sorted(_digests.stored()["pairs"])


def test_warming_declares_every_twin_and_counts_those_set_aside_apart(monkeypatch, tmp_path, capsys):
    """Every pair of ``digests.json`` is ready or is named as set aside; none is both."""
    pairs = _digests.stored()["pairs"]
    monkeypatch.setattr(_kernels, "warm", lambda: None)
    monkeypatch.setattr(_kernels, "backend", lambda: "numba")
    monkeypatch.setattr(_kernels, "set_aside", lambda: ["slam:ekf_predict_in_place"])
    target = tmp_path / "w.json"
    assert cli.main(["warm-cache", "--json", str(target)]) == 0
    said = json.loads(target.read_text())
    assert said["kernels"] == len(pairs) - 1
    assert said["set_aside"] == ["slam:ekf_predict_in_place"]
    assert {twin for _, twin in _kernels.REGISTRY.values()} == set(pairs)
    assert "slam:ekf_predict_in_place" in capsys.readouterr().out


def test_warming_says_when_there_is_nothing_to_compile(capsys):
    with _kernels.use_backend("numpy"):
        assert cli.main(["warm-cache"]) == 0
    assert "nothing to compile" in capsys.readouterr().out


def test_a_wrong_backend_in_the_environment_is_bad_input(monkeypatch, capsys):
    monkeypatch.setattr(_kernels, "_chosen", None)
    monkeypatch.setenv("VSLAM_REF_BACKEND", "cuda")
    assert cli.main(["warm-cache"]) == 2
    assert "VSLAM_REF_BACKEND='cuda'" in capsys.readouterr().err
