"""Every claim of the PTAM experiments on a world where it is true, and on one where it is false."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from vslam_ref.experiments.framework import Study, load, summaries
from vslam_ref.experiments.ptam import (
    fig2_1,
    fig2_2,
    fig2_3,
    framerate,
    offset_claims,
    parts,
    passes,
    two_pipelines,
    wrong_matches,
)
from vslam_ref.experiments.ptam.fig2_1 import Fig21Found
from vslam_ref.experiments.ptam.fig2_2 import MAPPER, FlowRun
from vslam_ref.experiments.ptam.fig2_3 import Fig23Run
from vslam_ref.experiments.ptam.framerate import FramerateConfig, FramerateRun
from vslam_ref.experiments.ptam.offset_runs import OffsetRun
from vslam_ref.experiments.ptam.parts import PartsRun
from vslam_ref.experiments.ptam.passes import PassesConfig, PassesRun
from vslam_ref.experiments.ptam.recorded import recorded
from vslam_ref.experiments.ptam.turning_claims import claims as turning_claims
from vslam_ref.experiments.ptam.turning_runs import TurningConfig, TurningRun
from vslam_ref.experiments.ptam.wrong_matches import LOSSES, WrongMatchesConfig, WrongMatchesRun
from vslam_ref.support.config import without_reason
from vslam_ref.support.errors import InputError
from vslam_ref.systems.ptam import STAGES

YES, NO, OPEN = "reproduced", "not reproduced", "not testable"
IDS = [s.id for s in summaries() if s.id.startswith("ptam-")]


def verdicts(claims: list) -> dict[str, str]:
    return {claim.id: claim.verdict for claim in claims}


@pytest.mark.parametrize("id", IDS)
def test_every_assumption_has_a_reason(id: str) -> None:
    experiment = load(id)
    assert without_reason(experiment.default()) == []
    assert without_reason(experiment.configure(quick=True)) == []


# --- offsets and scenes ---------------------------------------------------------------------------


def runs(count: int = 10, **fields: object) -> OffsetRun:
    """Runs that keep every bound; ``fields`` are others."""
    good: dict[str, object] = {
        "offset": np.arange(count), "started": np.ones(count, bool), "first": np.arange(count),
        "second": np.arange(count) + 8, "frames": np.full(count, 100), "tracked": np.full(count, 100),
        "lost": np.zeros(count, int), "share_all": np.ones(count), "share_after": np.ones(count),
        "error": np.full(count, 0.01), "live": np.full(count, 0.02), "second_error": np.full(count, 0.01),
        "drift": np.full(count, 0.8), "refined_error": np.full(count, 0.2),
        "refined_drift": np.full(count, 0.99), "keyframes": np.full(count, 9), "points": np.full(count, 900),
        "reason": np.full(count, "", "<U200"),
    }  # fmt: skip
    return OffsetRun(**(good | fields))  # type: ignore[arg-type]


def offsets_study(data: dict[str, OffsetRun], sequences: tuple[str, ...]) -> Study:
    return Study(SimpleNamespace(sequences=sequences), data)


def test_bounds_of_the_table_hold_and_do_not() -> None:
    every = offset_claims.claims(offsets_study({"kitchen": runs()}, ("kitchen",)))
    assert verdicts(every) == dict.fromkeys(
        ("kitchen-all-pictures", "kitchen-after-the-start", "kitchen-error", "kitchen-second-opinion"), YES
    )
    bad = runs(share_all=np.full(10, 0.9), share_after=np.full(10, 0.9), error=np.full(10, 5.0),
               second_error=np.full(10, 2.0))  # fmt: skip
    assert set(verdicts(offset_claims.claims(offsets_study({"kitchen": bad}, ("kitchen",)))).values()) == {NO}


def test_runs_without_a_start_count_as_the_worst() -> None:
    """Six of ten did not start: their missing numbers must not improve a median."""
    started = np.arange(10) >= 6
    nothing = np.where(started, 1.0, np.nan)
    half = runs(started=started, share_all=np.where(started, 1.0, 0.0), share_after=nothing,
                error=0.01 * nothing, second_error=0.01 * nothing)  # fmt: skip
    assert set(verdicts(offset_claims.claims(offsets_study({"kitchen": half}, ("kitchen",)))).values()) == {
        NO
    }


def test_one_late_start_is_too_many() -> None:
    late = runs(started=np.arange(10) != 4)
    found = [verdicts(offset_claims.claims(offsets_study({"alva": r}, ("alva",)))) for r in (runs(), late)]
    assert [f["alva-starts"] for f in found] == [YES, NO]


def test_a_refined_camera_is_judged_too() -> None:
    both = ("kitti-refined-error", "kitti-refined-drift")
    wrong = runs(refined_error=np.full(10, 0.5), refined_drift=np.full(10, 0.8))
    never = runs(refined_error=np.full(10, np.nan), refined_drift=np.full(10, np.nan))
    for data, expected in (
        (runs(), YES),
        (wrong, NO),
        (never, NO),
        (runs(refined_drift=np.full(10, 1.2)), NO),
    ):
        found = verdicts(offset_claims.claims(offsets_study({"kitti": data}, ("kitti",))))
        assert found["kitti-refined-drift"] == expected
        assert found["kitti-refined-error"] == (YES if data.refined_error[0] < 0.35 else NO)
        assert set(both) <= set(found)


def test_what_is_not_there_is_not_testable() -> None:
    found = offset_claims.claims(offsets_study({}, ("kitchen", "vtest")))
    assert set(verdicts(found).values()) == {OPEN}
    assert all("not found here" in claim.sentence for claim in found)


def test_a_fixed_camera_must_not_start_and_must_say_why() -> None:
    reason = np.full(10, "no motion", "<U200")
    quiet = runs(started=np.zeros(10, bool), reason=reason)
    one = runs(started=np.arange(10) == 3, reason=reason)
    silent = runs(started=np.zeros(10, bool))
    found = [
        verdicts(offset_claims.claims(offsets_study({"vtest": r}, ("vtest",)))) for r in (quiet, one, silent)
    ]
    assert [f["vtest-no-start"] for f in found] == [YES, NO, NO]


def test_the_table_has_ten_offsets_and_bounds() -> None:
    for each in recorded().values():
        if each.data_set:
            assert len(each.offsets) == len(set(each.offsets)) == 10
        assert each.must_not_start or (each.most_error is not None and each.error_unit)


def test_missing_data_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VSLAM_REF_DATA", raising=False)
    experiment = load("ptam-offsets")
    assert "new_tsukuba_150" in experiment.missing(experiment.default())
    assert not load("ptam-scenes").missing(load("ptam-scenes").default())
    assert load("ptam-fig2.1").missing(load("ptam-fig2.1").default()) == ["7scenes_redkitchen"]
    with pytest.raises(InputError, match="need some of kitchen"):
        experiment.configure(overrides=["sequences=kitchn"])


# --- wrong matches --------------------------------------------------------------------------------


def matches_study(l2: float, huber: float, tukey: float, efficiency: float, count: int = 40) -> Study:
    """Errors with these means at every share of wrong matches."""
    rng = np.random.default_rng(0)
    config = WrongMatchesConfig(runs=count)
    scatter = rng.uniform(0.9, 1.1, (count, 2, len(config.wrong), 1))
    error = np.array([{"l2": l2, "huber": huber, "tukey": tukey}[name] for name in LOSSES]) * scatter
    honest = np.sqrt(np.stack([np.full((count, 5), efficiency), np.ones((count, 5))], -1)) * 0.1
    return Study(config, WrongMatchesRun(error, honest, np.full(count, 5.0)))


def test_losses() -> None:
    assert set(verdicts(wrong_matches.claims(matches_study(0.6, 0.4, 0.1, 0.95))).values()) == {YES}
    assert set(verdicts(wrong_matches.claims(matches_study(1.2, 1.2, 1.2, 0.85))).values()) == {NO}
    too_good = verdicts(wrong_matches.claims(matches_study(0.6, 0.4, 0.1, 0.995)))
    assert too_good["price-on-honest-matches"] == NO


# --- one pass and two -----------------------------------------------------------------------------


def passes_study(reach: dict[str, float], work: dict[str, float]) -> Study:
    config = PassesConfig()
    pixels = np.array(config.pixels)
    error = np.stack([np.where(pixels <= reach[way], 0.2, 30.0) for way in passes.WAYS])
    error = np.broadcast_to(error[None, :, :, None], (config.runs, 3, len(pixels), config.jumps))
    compared = np.broadcast_to(np.array([work[way] for way in passes.WAYS])[None, :, None, None], error.shape)
    return Study(config, PassesRun(error, compared, np.full(config.runs, 500)))


def test_two_passes() -> None:
    work = {"narrow": 1.0, "wide": 50.0, "two": 5.0}
    true = passes_study({"narrow": 4, "wide": 24, "two": 32}, work)
    false = passes_study({"narrow": 24, "wide": 48, "two": 32}, work | {"wide": 8.0})
    assert set(verdicts(passes.claims(true)).values()) == {YES}
    assert set(verdicts(passes.claims(false)).values()) == {NO}
    nothing = passes_study({"narrow": -1, "wide": -1, "two": -1}, work)
    assert verdicts(passes.claims(nothing))["two-passes-are-steadier"] == NO


# --- pure rotation --------------------------------------------------------------------------------


def turning_study(**fields: object) -> Study:
    """Six rooms and five arms as A says: lost on the spot, not on the arm."""
    config = TurningConfig()
    shape = len(config.arms), config.runs
    lost = np.full(shape, np.nan)
    lost[0] = 55.0
    points = np.full(shape, 900)
    points[0] = 0
    true: dict[str, object] = {
        "lost_at": lost, "points": points, "keyframes": np.where(np.isnan(lost), 9, 0),
        "wander": np.full(shape, 0.02),
        "share": np.where(np.isnan(lost), 1.0, 0.45), "started": np.ones(shape, bool),
        "alone": np.zeros(shape, bool), "reason": np.full(shape, "no parallax"),
    }  # fmt: skip
    return Study(config, TurningRun(**(true | fields)))  # type: ignore[arg-type]


def test_turning_on_the_spot() -> None:
    shape = len(TurningConfig().arms), 6
    assert set(verdicts(turning_claims(turning_study())).values()) == {YES}
    false = turning_study(
        lost_at=np.vstack([np.full((1, 6), 118.0), np.full((4, 6), 70.0)]), points=np.full(shape, 900),
        keyframes=np.full(shape, 5), alone=np.ones(shape, bool),
    )  # fmt: skip
    assert set(verdicts(turning_claims(false)).values()) == {NO}


def test_a_wrong_place_is_not_tracked() -> None:
    shape = len(TurningConfig().arms), 6
    assert verdicts(turning_claims(turning_study(wander=np.full(shape, 0.5))))["an-arm-is-enough"] == NO


def test_rooms_without_a_map_prove_nothing() -> None:
    shape = len(TurningConfig().arms), 6
    found = verdicts(turning_claims(turning_study(started=np.zeros(shape, bool))))
    assert found["pure-rotation-is-lost"] == found["no-parallax-no-points"] == found["an-arm-is-enough"] == NO


# --- figures --------------------------------------------------------------------------------------


def levels(scale: list[float], corners: list[int]) -> Study:
    xy = tuple(np.zeros((n, 2), np.int32) for n in corners)
    images = tuple(np.zeros((60, 80), np.uint8) for _ in corners)
    nothing = np.zeros((0, 2))
    found = Fig21Found(7, images, xy, nothing, nothing, np.zeros(0, int), 5.0, np.full(4, 99), np.full(4, 99),
                       np.array(scale))  # fmt: skip
    return Study(fig2_1.Fig21Config(), None, found)


def test_levels() -> None:
    assert set(verdicts(fig2_1.claims(levels([0.5, 1.0, 2.1, 4.0], [900, 300, 90, 30]))).values()) == {YES}
    assert set(verdicts(fig2_1.claims(levels([0.5, 0.55, 2.1, 4.0], [900, 300, 90, 3]))).values()) == {NO}
    unknown = fig2_1.claims(levels([0.5, np.nan, np.nan, np.nan], [900, 300, 90, 30]))
    assert verdicts(unknown)["sigma-doubles-from-level-to-level"] == OPEN


def flow(stray: bool = False, skipped: bool = False) -> Study:
    """Twenty pictures, every fourth a keyframe, the last one with the adjustment of all."""
    keyframe = np.arange(20) % 4 == 3
    part = np.zeros((20, len(STAGES)), bool)
    for name in ("prepare", "coarse", "fine", "pose"):
        part[:, STAGES.index(name)] = True
    for name in MAPPER[:-1]:
        part[keyframe, STAGES.index(name)] = True
    part[19, STAGES.index("global")] = True
    if stray:
        part[0, STAGES.index("local")] = part[1, STAGES.index("global")] = True
    if skipped:
        part[2, STAGES.index("coarse")] = part[3, STAGES.index("local")] = False
    return Study(
        fig2_2.Fig22Config(), None, FlowRun(part, keyframe, np.zeros(20, bool), np.ones(len(STAGES)))
    )


def test_flow() -> None:
    assert set(verdicts(fig2_2.claims(flow())).values()) == {YES}
    assert set(verdicts(fig2_2.claims(flow(stray=True, skipped=True))).values()) == {NO}
    empty = FlowRun(
        np.zeros((0, len(STAGES)), bool), np.zeros(0, bool), np.zeros(0, bool), np.ones(len(STAGES))
    )
    nothing = fig2_2.claims(replace(flow(), once=empty))
    found = verdicts(nothing)
    assert found.pop("adjustment-of-all-keyframes") == OPEN
    assert set(found.values()) == {NO}


def test_plane_and_house() -> None:
    five = np.full(5, 1.0)
    good = Fig23Run(five > 0, 0.5 * five, 0.01 * five, 0.2 * five, np.full(5, 300))
    bad = Fig23Run(five > 0, 5 * five, 0.05 * five, 3.0 * five, np.full(5, 300))
    none = Fig23Run(five < 0, np.nan * five, np.nan * five, np.nan * five, np.zeros(5, int))
    found = [
        set(verdicts(fig2_3.claims(Study(fig2_3.Fig23Config(), data))).values()) for data in (good, bad, none)
    ]
    assert found == [{YES}, {NO}, {NO}]


def rates(seconds: float) -> Study:
    config = FramerateConfig()
    run = FramerateRun(*(np.full((1, 100), v) for v in (0.8 * seconds, seconds)), np.zeros((1, 100), bool),
                       np.full((1, 100), 300))  # fmt: skip
    return Study(config, {framerate.words(case): run for case in framerate.cases(config)})


def test_frame_rates() -> None:
    assert set(verdicts(framerate.claims(rates(1 / 15))).values()) == {YES}
    assert set(verdicts(framerate.claims(rates(1 / 100))).values()) == {NO}
    assert set(verdicts(framerate.claims(rates(1 / 25))).values()) == {NO}  # always above 20


# --- parts ----------------------------------------------------------------------------------------


def parts_study(without: tuple[float, float], published: tuple[float, float], whole: float = 1.0) -> Study:
    """Five seeds; share and error of the system without the part, and as published; the whole has 0.1 %."""
    config = parts.PartsConfig()
    told = {parts.WHOLE: (whole, 0.1), parts.PUBLISHED: published}
    data = {}
    for variant in parts.variants(config):
        share, error = told.get(variant.preset, without)
        data[parts.words(variant)] = PartsRun(np.ones(5, bool), np.full(5, share), np.full(5, error))
    return Study(config, data)


def test_parts() -> None:
    assert set(verdicts(parts.claims(parts_study((0.5, 0.1), (1.0, 3.0)))).values()) == {YES}
    assert set(verdicts(parts.claims(parts_study((1.0, 0.5), (0.4, 0.1)))).values()) == {YES}
    assert set(verdicts(parts.claims(parts_study((0.95, 0.15), (1.0, 0.1)))).values()) == {NO}
    lost = verdicts(parts.claims(parts_study((0.5, 0.9), (0.5, 0.9), whole=0.7)))
    assert [v for id, v in lost.items() if id != "published-constants"] == [NO] * 4


def test_a_run_without_an_error_is_the_worst() -> None:
    """Without a path there is no error: that must not make a part look useless."""
    found = verdicts(parts.claims(parts_study((1.0, np.nan), (1.0, np.nan))))
    assert set(found.values()) == {YES}


# --- two pipelines --------------------------------------------------------------------------------


def latencies(in_line: float, beside: float, error: float = 0.1, got: float = 0.95) -> Study:
    """Two of a hundred pictures are this late, the others 10 ms."""
    latency = {way: np.where(np.arange(100) < 2, late, 0.01) for way, late in
               zip(two_pipelines.WAYS, (in_line, beside), strict=True)}  # fmt: skip
    errors = {way: np.full(3, error) for way in two_pipelines.WAYS}
    return Study(two_pipelines.TwoPipelinesConfig(), None, two_pipelines.LatencyRun(latency, errors, got))


def test_two_pipelines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(two_pipelines, "cores", lambda: 2)
    assert set(verdicts(two_pipelines.claims(latencies(0.3, 0.02))).values()) == {YES}
    assert set(verdicts(two_pipelines.claims(latencies(0.3, 0.1, error=2.0))).values()) == {NO}
    not_needed = verdicts(two_pipelines.claims(latencies(0.02, 0.02, error=np.nan)))
    assert set(not_needed.values()) == {NO}
    name = "two-pipelines-make-real-time-possible"
    busy = two_pipelines.claims(latencies(0.3, 0.02, got=0.5))
    assert verdicts(busy)[name] == OPEN
    assert "had the processor for 50 % of the time" in busy[0].sentence
    monkeypatch.setattr(two_pipelines, "cores", lambda: 1)
    assert verdicts(two_pipelines.claims(latencies(0.3, 0.02)))[name] == OPEN


def test_a_picture_that_waits_is_late_by_that() -> None:
    """Steps of 30 ms where pictures come every 10: the n-th waits 20 n ms."""
    tracked = SimpleNamespace(quality=None)

    class Slow:
        map = object()

        def step(self, k: int, image: object) -> SimpleNamespace:
            time.sleep(0.03)
            return SimpleNamespace(tracked=tracked)

    late, (cpu, wall) = two_pipelines.paced(Slow(), [np.zeros(0)] * 20, 100.0)  # type: ignore[arg-type]
    least = 0.03 + 0.02 * np.arange(two_pipelines.SETTLED, 20)
    assert len(late) == 20 - two_pipelines.SETTLED
    assert (late >= least - 1e-3).all()
    assert wall >= 20 * 0.03 - 1e-3
    assert cpu < 0.5 * wall  # it only slept
