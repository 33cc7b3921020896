"""The sentence of a claim is made from its numbers, ends with its verdict, and names no key."""

from __future__ import annotations

import re

import pytest

from vslam_ref.experiments.framework import load

QUICK = {
    "tukey-errata": ["runs=3", "starts=0,4"],
    "bundle-sparsity": [],
    "iekf-circle": [],
    "iekf-reduced": [],
    "grids-moved-chair": ["watch=10", "settle=4"],
}


@pytest.mark.parametrize("id", QUICK)
def test_sentences_are_plain_and_carry_numbers(id):
    experiment = load(id)
    study = experiment.run(experiment.configure(quick=True, overrides=QUICK[id]))
    for claim in experiment.judge(study, quick=True):
        assert claim.sentence.endswith(f": {claim.verdict}."), claim.id
        assert claim.sentence[0].isupper(), claim.id
        assert re.search(r"\d", claim.sentence), claim.sentence
        assert not re.search(r"\w_\w|\bnan\b|[{}]", claim.sentence), claim.sentence
        assert claim.quick
        assert claim.small_sample == (claim.least_runs is not None and claim.runs < claim.least_runs)
