"""What B 4.1 says about figures 2, 3 and 4: one entry per statement, each with its rule.

A sentence of the paper that states two things has two entries, so that one can fail without the other.
Texts are our rendering of the Chinese; ``[...]`` marks how an unclear phrase is read.  "IEKF" is the
paper's *improved* EKF, the second-order Carleman lift; neither the invariant nor the iterated filter.
"""

from __future__ import annotations

from dataclasses import dataclass

from vslam_ref.experiments.iekf import measures as m
from vslam_ref.experiments.iekf import naive
from vslam_ref.experiments.iekf.rules import APART, BRIEF, MARKED, MUCH, Reading, Rule

EKF_LOW, EKF_HIGH = "nees:ekf/low", "nees:ekf/high"
IEKF_LOW, IEKF_HIGH = "nees:iekf/low", "nees:iekf/high"


@dataclass(frozen=True)
class Sentence:
    """One statement of B 4.1."""

    id: str
    figure: int
    place: int
    text: str
    rule: Rule

    @property
    def source(self) -> str:
        """Where it stands; sentences are counted from the one that introduces the figure."""
        return f"B 4.1, figure {self.figure}, sentence {self.place}"


def _consistent(series: str, measure: m.Measure, reading: Reading) -> Rule:
    """Not more than a consistent filter would show."""
    return Rule((series,), measure, above=False, null="inflated", calibrated=True, naive=reading)


def _inconsistent(series: tuple[str, ...], measure: m.Measure, reading: Reading) -> Rule:
    """More than a consistent filter would show."""
    return Rule(series, measure, above=True, null="consistent", calibrated=True, naive=reading)


def _higher(series: tuple[str, ...], measure: m.Measure, effect: float = 1.0) -> Rule:
    """First side higher than the second, by more than a coin on the labels would show."""
    reading = naive.over(measure, 1.0)
    return Rule(series, measure, above=True, null="swapped", calibrated=True, effect=effect, naive=reading)


FIGURE_2 = (
    Sentence(
        "ekf-low-lap1-consistent", 2, 3,
        "Low initial uncertainty: the EKF is consistent during the first loop.",
        _consistent(EKF_LOW, m.maximum("lap 1"), naive.hardly_above("lap 1")),
    ),
    Sentence(
        "ekf-low-exceeds-at-closure", 2, 3,
        "Low initial uncertainty: when the first loop ends, at 80 s, the EKF's NEES exceeds the threshold.",
        _inconsistent((EKF_LOW,), m.average("after closure"), naive.mostly_above("after closure")),
    ),
    Sentence(
        "ekf-low-lap2-inconsistent", 2, 3,
        "Low initial uncertainty: the EKF is inconsistent during the second loop.",
        _inconsistent((EKF_LOW,), m.average("lap 2"), naive.mostly_above("lap 2")),
    ),
    Sentence(
        "ekf-high-exceeds-in-lap1", 2, 4,
        "High initial uncertainty: the EKF's NEES exceeds the threshold already during the first loop.",
        _inconsistent((EKF_HIGH,), m.maximum("lap 1"), naive.mostly_above("lap 1")),
    ),
    Sentence(
        "ekf-high-marked-growth", 2, 4,
        "High initial uncertainty: after 80 m the EKF's NEES grows markedly [80 m read as the end of lap 1].",
        Rule(
            (EKF_HIGH,), m.growth_at_closure(), above=True, null="consistent", calibrated=True,
            effect=MARKED, naive=naive.over(m.growth_at_closure(), 1.0),
        ),
    ),
    Sentence(
        "ekf-high-inconsistent", 2, 4,
        "High initial uncertainty: the EKF is inconsistent during both loops.",
        _inconsistent(
            (EKF_HIGH,), m.least_average("lap 1", "lap 2"), naive.mostly_above("lap 1", "lap 2")
        ),
    ),
    Sentence(
        "ekf-fails-at-end", 2, 5,
        "After both loops, 160 s, the EKF has failed for the low and for the high initial uncertainty.",
        _inconsistent((EKF_LOW, EKF_HIGH), m.least_average("end"), naive.mostly_above("end")),
    ),
    Sentence(
        "ekf-p0-amplifies", 2, 6,
        "A larger initial uncertainty amplifies the EKF's inconsistency during the first loop.",
        _higher((EKF_HIGH, EKF_LOW), m.ratio("lap 1")),
    ),
)  # fmt: skip

FIGURE_3 = (
    Sentence(
        "iekf-low-below", 3, 2,
        "Low initial uncertainty: the IEKF's NEES stays below the threshold during both loops.",
        _consistent(IEKF_LOW, m.maximum("both laps"), naive.hardly_above("lap 1", "lap 2")),
    ),
    Sentence(
        "iekf-low-no-growth", 3, 2,
        "Low initial uncertainty: the IEKF's NEES does not grow markedly at 80 s.",
        Rule(
            (IEKF_LOW,), m.growth_at_closure(), above=False, null="grown", calibrated=False, effect=MARKED
        ),
    ),
    Sentence(
        "iekf-low-closures-consistent", 3, 3,
        "Low initial uncertainty: the IEKF is consistent while the two loops are closed.",
        _consistent(
            IEKF_LOW, m.greatest_average("closure", "end"), naive.hardly_above("closure", "end")
        ),
    ),
    Sentence(
        "iekf-low-unlike-ekf", 3, 3,
        "Low initial uncertainty: in that the IEKF differs from the EKF [lap 2: its NEES is lower].",
        _higher((EKF_LOW, IEKF_LOW), m.ratio("lap 2")),
    ),
    Sentence(
        "iekf-high-above-in-lap1", 3, 4,
        "High initial uncertainty: during the first loop the IEKF's NEES is above the threshold for a time.",
        _inconsistent((IEKF_HIGH,), m.maximum("lap 1"), naive.over(m.share_above_line("lap 1"), 0.0)),
    ),
    Sentence(
        "iekf-high-lap1-brief", 3, 4,
        "High initial uncertainty: that time above the threshold in the first loop is short.",
        Rule(
            (IEKF_HIGH,), m.share_above_line("lap 1"), above=False, null="inflated", calibrated=False,
            effect=BRIEF, naive=naive.at_times_above("lap 1"),
        ),
    ),
    Sentence(
        "iekf-high-gradual-rise", 3, 5,
        "High initial uncertainty: the IEKF's NEES rises gradually during the second loop.",
        Rule(
            (IEKF_HIGH,), m.rise_in_lap_2(), above=True, null="consistent", calibrated=True,
            effect=0.0, naive=naive.over(m.rise_in_lap_2(), 0.0),
        ),
    ),
    Sentence(
        "iekf-high-ends-above", 3, 5,
        "High initial uncertainty: in the second loop the IEKF's NEES passes the threshold.",
        _inconsistent((IEKF_HIGH,), m.average("end"), naive.mostly_above("end")),
    ),
    Sentence(
        "iekf-high-slow-growth", 3, 5,
        "High initial uncertainty: it grows slowly [more slowly than the EKF's].",
        Rule(
            (EKF_HIGH, IEKF_HIGH), m.rise_difference(), above=True, null="swapped", calibrated=True,
            effect=0.0, naive=naive.over(m.rise_difference(), 0.0),
        ),
    ),
    Sentence(
        "iekf-high-lap2-inconsistent", 3, 6,
        "High initial uncertainty: the IEKF is inconsistent during the second loop.",
        _inconsistent((IEKF_HIGH,), m.average("lap 2"), naive.mostly_above("lap 2")),
    ),
    Sentence(
        "iekf-high-much-better", 3, 6,
        "High initial uncertainty: that is much better than the EKF's result.",
        _higher((EKF_HIGH, IEKF_HIGH), m.ratio("lap 2"), effect=MUCH),
    ),
    Sentence(
        "iekf-low-better-than-high", 3, 6,
        "The result is better when the value is lower [the IEKF with low against high initial uncertainty].",
        _higher((IEKF_HIGH, IEKF_LOW), m.ratio("both laps")),
    ),
    Sentence(
        "iekf-p0-little-influence", 3, 7,
        "The initial uncertainty has little influence on the IEKF.",
        Rule(
            (IEKF_HIGH, IEKF_LOW), m.difference_factor("both laps"), above=False, null="scaled",
            calibrated=False, effect=MARKED,
        ),
    ),
    Sentence(
        "iekf-p0-less-than-ekf", 3, 7,
        "Unlike the EKF it reduces the inconsistency [of a high initial uncertainty against a low one].",
        _higher((EKF_HIGH, EKF_LOW, IEKF_HIGH, IEKF_LOW), m.ratio_of_ratios("both laps")),
    ),
)  # fmt: skip

FIGURE_4 = (
    Sentence(
        "error-high-lap1", 4, 2,
        "High initial uncertainty: in the first loop the EKF's error curve lies clearly above the IEKF's.",
        _higher(("error:ekf/high", "error:iekf/high"), m.ratio("lap 1"), effect=APART),
    ),
    Sentence(
        "error-high-lap2", 4, 2,
        "High initial uncertainty: in the second loop the EKF's error curve lies clearly above the IEKF's.",
        _higher(("error:ekf/high", "error:iekf/high"), m.ratio("lap 2"), effect=APART),
    ),
    Sentence(
        "error-high-mean", 4, 2,
        "High initial uncertainty: that is, the EKF's mean error is higher than the IEKF's.",
        _higher(("error:ekf/high", "error:iekf/high"), m.ratio("both laps")),
    ),
    Sentence(
        "error-low-lap1-similar", 4, 3,
        "Low initial uncertainty: in the first loop the two error curves hardly differ.",
        Rule(
            ("error:ekf/low", "error:iekf/low"), m.difference_factor("lap 1"), above=False, null="scaled",
            calibrated=False, effect=APART,
        ),
    ),
    Sentence(
        "error-low-lap2", 4, 4,
        "Low initial uncertainty: in the second loop the EKF's mean error is higher than the IEKF's.",
        _higher(("error:ekf/low", "error:iekf/low"), m.ratio("lap 2")),
    ),
    Sentence(
        "iekf-more-consistent", 4, 5,
        "Altogether the IEKF's estimates are the more consistent ones [lower NEES, low and high].",
        _higher((EKF_LOW, EKF_HIGH, IEKF_LOW, IEKF_HIGH), m.least_ratio("both laps")),
    ),
)  # fmt: skip

SENTENCES: dict[str, Sentence] = {s.id: s for s in (*FIGURE_2, *FIGURE_3, *FIGURE_4)}


def claim_ids(figure: int) -> list[str]:
    """Ids of the claims about figure 2, 3 or 4, in the paper's order."""
    ids = [s.id for s in SENTENCES.values() if s.figure == figure]
    if not ids:
        raise ValueError(f"B 4.1 makes claims about figures 2, 3 and 4, not {figure}")
    return ids


def rules_table() -> str:
    """All rules as a Markdown table, for the book."""
    rows = ["| claim | place | B says | rule | null world |", "|---|---|---|---|---|"]
    for s in SENTENCES.values():
        rule = s.rule.text().split("; null world")[0]
        rows.append(f"| `{s.id}` | fig. {s.figure}, {s.place} | {s.text} | {rule} | {s.rule.null} |")
    return "\n".join(rows)
