"""Exercise 19.1: two maps of a corridor."""

import numpy as np

UNSEEN, MISS, HIT = 0, 1, 2
DECIDED = np.log(0.9 / 0.1)
S_HIGH, S_LOW, S_MISS = 0.8, 0.3, 0.3
D_HIGH, D_LOW, D_MISS = 0.95, 0.05, 0.05
S_BOUND = np.log(0.999 / 0.001)


def observe(reading: float, n: int) -> np.ndarray:
    """What one reading says of every cell: free before it, something in its own cell, nothing behind."""
    seen = np.full(n, UNSEEN)
    if not reading > 0:  # nan, too
        return seen
    if reading >= n:
        seen[:] = MISS
        return seen
    cell = int(reading)
    seen[:cell] = MISS
    seen[cell] = HIT
    return seen


def log_odds(p: np.ndarray) -> np.ndarray:
    """ln(p / (1 - p))."""
    return np.log(p / (1 - p))


def update(S: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """S_t and D_t: the table is looked up with S_{t-1}, and D starts from nothing."""
    was_free = S < -DECIDED
    hit, miss = seen == HIT, seen == MISS
    p_s = np.where(hit, np.where(was_free, S_LOW, S_HIGH), S_MISS)
    p_d = np.where(hit, np.where(was_free, D_HIGH, D_LOW), D_MISS)
    looked = hit | miss
    new_s = np.where(looked, np.clip(S + log_odds(p_s), -S_BOUND, S_BOUND), S)
    return new_s, np.where(looked, log_odds(p_d), 0.0)


def settled(hit_for: np.ndarray, S: np.ndarray, seconds: float) -> np.ndarray:
    """S before an update; free cells that were hit long enough become unknown."""
    return np.where((S < -DECIDED) & (hit_for >= seconds), 0.0, S)
