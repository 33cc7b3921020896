"""Numba twins of the grids' hot loops: one walk per beam, then one visit per cell that was seen.

A beam is walked column by column along its longer axis, as in :mod:`vslam_ref.grids.rays`, with the height above
the present row kept as an integer: no rounding, no division.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from vslam_ref._kernels._signature import changed, given, kernel

QUANTA = 4096
MAX_LENGTH = 16384
MISS, HIT, EXPLAINED = 1, 2, 3
DECIDED_LOG_ODDS = np.log(0.9 / (1.0 - 0.9))


@njit(cache=True)
def _check(start, ends):
    for i in range(ends.shape[0]):
        for a in range(2):
            if not abs(ends[i, a] - start[a]) <= MAX_LENGTH:
                raise ValueError(
                    "a beam is not finite or spans more than 16384 cells; take a coarser resolution"
                )


@njit(cache=True)
def _quanta(x):
    return np.int64(np.rint(x * QUANTA))


@njit(cache=True)
def _mark_cell(flat, order, n, at):
    """Mark a cell as MISS, and put it in the list if it was unseen; returns the length of the list."""
    order[n] = at
    n += flat[at] == 0
    flat[at] = max(flat[at], np.uint8(MISS))
    return n


@njit(cache=True)
def _walk(flat, columns, order, n, x0, y0, x1, y1):
    """Mark the cells that one beam, given in quanta, crosses; returns the length of the list."""
    dx, dy = x1 - x0, y1 - y0
    sx = 1 if dx >= 0 else -1
    sy = 1 if dy >= 0 else -1
    # mirrored to run to the right and upwards: the floor of the mirrored start is the first cell
    i, px = (sx * x0) // QUANTA, (sx * x0) % QUANTA
    j, py = (sy * y0) // QUANTA, (sy * y0) % QUANTA
    i = i if sx > 0 else -1 - i
    j = j if sy > 0 else -1 - j
    at = j * columns + i
    if abs(dx) >= abs(dy):
        du, dv, pu, pv, along, across = abs(dx), abs(dy), px, py, sx, sy * columns
    else:
        du, dv, pu, pv, along, across = abs(dy), abs(dx), py, px, sy * columns, sx
    run, rise = du * QUANTA, dv * QUANTA
    height = pv * du - pu * dv  # above the present row, in 1 / run
    last = max((pu + du + QUANTA - 1) // QUANTA, 1) - 1
    left = max((pv + dv + QUANTA - 1) // QUANTA, 1) - 1  # rows still to climb
    for _ in range(last):
        n = _mark_cell(flat, order, n, at)
        height += rise
        if height > run:  # leaves by the next row; at a corner it does not
            n = _mark_cell(flat, order, n, at + across)
        up = height >= run
        height -= run * up
        left -= up
        at += along + across * up
    n = _mark_cell(flat, order, n, at)
    if left > 0:
        n = _mark_cell(flat, order, n, at + across)
    return n


@njit(cache=True)
def _mark(flat, columns, order, start, ends, hit, low):
    """Mark all beams; returns how many cells are in the list."""
    x0, y0 = _quanta(start[0] - low[0]), _quanta(start[1] - low[1])
    n = 0
    for b in range(ends.shape[0]):
        x1, y1 = _quanta(ends[b, 0] - low[0]), _quanta(ends[b, 1] - low[1])
        if hit[b]:
            at = (y1 // QUANTA) * columns + x1 // QUANTA
            order[n] = at
            n += flat[at] == 0
            flat[at] = HIT
        n = _walk(flat, columns, order, n, x0, y0, x1, y1)
    return n


@njit(cache=True)
def _observe(start, ends, hit):
    """(window, flat; its cells in the order in which they were first seen; its corner; its columns)."""
    low, high = np.empty(2, np.int64), np.empty(2, np.int64)
    for a in range(2):
        least = most = start[a]
        for b in range(ends.shape[0]):
            least, most = min(least, ends[b, a]), max(most, ends[b, a])
        low[a], high[a] = np.int64(np.floor(least)) - 1, np.int64(np.floor(most)) + 2
    columns, rows = high[0] - low[0], high[1] - low[1]
    window = np.zeros(rows * columns, np.uint8)
    order = np.empty(rows * columns + 1, np.int64)
    n = _mark(window, columns, order, start, ends, hit, low)
    return window, order[:n], low, columns


@kernel(changed(2, types.uint8), given(1), given(2), given(1, types.boolean))
def mark_beams(window, start, ends, hit):
    """Twin of :func:`vslam_ref.grids.rays.mark_beams`."""
    _check(start, ends)
    rows, columns = window.shape
    flat = np.zeros(rows * columns, np.uint8)
    order = np.empty(rows * columns + 1, np.int64)
    n = _mark(flat, columns, order, start, ends, hit, np.zeros(2, np.int64))
    for k in range(n):
        window[order[k] // columns, order[k] % columns] = flat[order[k]]


@kernel(
    changed(1), types.int64, given(1), given(2), given(1, types.boolean), given(1), types.float64
)  # fmt: skip
def apply_plain(log_odds, columns, start, ends, hit, evidence, bound):
    """Twin of :func:`vslam_ref.grids.plain.apply_plain`."""
    _check(start, ends)
    window, order, low, width = _observe(start, ends, hit)
    base, more = low[1] * columns + low[0], columns - width
    for k in range(order.shape[0]):
        at = base + order[k] + (order[k] // width) * more
        v = log_odds[at] + evidence[window[order[k]] - MISS]
        log_odds[at] = min(max(v, -bound), bound)


@njit(cache=True)
def _near_static(s, columns, at, reach):
    row, column = at // columns, at % columns
    for r in range(max(row - reach, 0), min(row + reach + 1, s.shape[0] // columns)):
        for c in range(max(column - reach, 0), min(column + reach + 1, columns)):
            if s[r * columns + c] > DECIDED_LOG_ODDS:
                return True
    return False


@njit(cache=True)
def _state(log_odds):
    if log_odds > DECIDED_LOG_ODDS:
        return 2
    return 0 if log_odds < -DECIDED_LOG_ODDS else 1


@kernel(
    *(changed(1),) * 4, types.int64, given(1), given(2), given(1, types.boolean),
    given(2), given(2), given(1), types.float64,
)  # fmt: skip
def apply_scan(s, d, seen, since, columns, start, ends, hit, steps_s, steps_d, limits, now):
    """Twin of :func:`vslam_ref.grids.static_dynamic.apply_scan`."""
    _check(start, ends)
    s_bound, d_bound, lifetime, settle, reach = limits[0], limits[1], limits[2], limits[3], int(limits[4])
    window, order, low, width = _observe(start, ends, hit)
    base, more = low[1] * columns + low[0], columns - width
    if reach > 0:  # before S changes
        for k in range(order.shape[0]):
            if window[order[k]] == HIT:
                at = base + order[k] + (order[k] // width) * more
                if _near_static(s, columns, at, reach):
                    window[order[k]] = EXPLAINED
    for k in range(order.shape[0]):
        look = window[order[k]]
        at = base + order[k] + (order[k] // width) * more
        old = s[at]
        state = _state(old)
        is_hit = 1 if look >= HIT else 0
        since[at] = min(since[at], now) if is_hit else np.inf
        if is_hit and state == 0 and now - since[at] >= settle:
            old, state = 0.0, 1
        prior = 0.0 if now - seen[at] > lifetime else d[at]
        step = steps_d[2, 1] if look == EXPLAINED else steps_d[state, is_hit]
        s[at] = min(max(old + steps_s[state, is_hit], -s_bound), s_bound)
        d[at] = min(max(prior + step, -d_bound), d_bound)
        seen[at] = now
