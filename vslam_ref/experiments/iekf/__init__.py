"""The claims of B 4.1 about figures 2, 3 and 4, and the rules that judge them.

============================  =====================================================================
module                        holds
============================  =====================================================================
``sentences``                 every statement of B 4.1 with its rule: the table fixed before the runs
``measures``                  windows, and statistics of mean curves
``rules``                     sizes of effect words, worlds in which a claim is false, the rule
``naive``                     the sentences read pointwise, reported beside the rules
``worlds``                    draws of runs, and worlds in which a claim is false
``evaluation``                thresholds, shares, intervals and null rates of many claims in one pass
``verdicts``                  the verdict rule, and the door: per-run arrays in, claims out
``study``, ``figures``        the Monte Carlo study; figures 2, 3 and 4
``grid``, ``settings``        the settings of ``sensitivity``, and one of them run and judged
``grid_rules``                what the grid as a whole says
``neighbours``                what ``circle`` and ``bailey``, on other public setups, share
``errata``, ``reduced``       the misprints run as printed; the lifted filter and its reduction
============================  =====================================================================
"""

from vslam_ref.experiments.iekf.sentences import SENTENCES, Sentence, claim_ids, rules_table
from vslam_ref.experiments.iekf.verdicts import StudyArrays, all_at_once, conclude, evaluate, judge

__all__ = [
    "SENTENCES",
    "Sentence",
    "StudyArrays",
    "all_at_once",
    "claim_ids",
    "conclude",
    "evaluate",
    "judge",
    "rules_table",
]
