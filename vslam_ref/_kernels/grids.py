"""Numba twins of the grids' hot loops: one walk per beam, then one pass over the scan's window.

A beam is walked column by column along its longer axis, as in :mod:`vslam_ref.grids.rays`, with the height
above the next row kept as an integer: no rounding, no division.
"""

from __future__ import annotations

import numpy as np
from numba import types

from vslam_ref._kernels._signature import given, kernel, njit, unpacks

QUANTA = 4096
MAX_LENGTH = 16384
UNSEEN, GRAZE, MISS, HIT = 0, 1, 2, 3
EXPLAINED, IN_LINE = 4, 8  # flags of a hit
FREE, UNKNOWN, OCCUPIED = 0, 1, 2
DECIDED_LOG_ODDS = np.log(0.9 / (1.0 - 0.9))
TOO_LONG = "a beam is not finite or spans more than 16384 cells; take a coarser resolution"
OUTSIDE = "a beam leaves the map, or comes within a cell of its border; grow the map first"
LAYER = types.Array(types.float64, 1, "C")  # row by row: known to be contiguous, so loops become vector code


@njit(cache=True)
def _quanta(x):
    return np.int64(np.rint(x * QUANTA))


@njit(cache=True)
def _step(at, height, along, across, rise, run):
    """(last cell in this column, first cell in the next, its height); choices only, no branches."""
    height += rise
    other = at + (across if height > 0 else 0)
    onward = at + along + (across if height >= 0 else 0)
    return other, onward, height - (run if height >= 0 else 0)


@njit(cache=True)
def _walk(flat, columns, x0, y0, x1, y1, grazing):
    """Mark MISS along one beam, given in quanta, and GRAZE in its last ``grazing`` columns."""
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
    rise, run = dv * QUANTA, du * QUANTA
    height = pv * du - pu * dv - run  # above the next row, in 1 / run
    steps = max((pu + du + QUANTA - 1) // QUANTA, 1) - 1
    climb = max((pv + dv + QUANTA - 1) // QUANTA, 1) - 1
    last = at + along * steps + across * climb
    body = min(max(steps + 1 - grazing, 0), steps)
    for _ in range(body):
        flat[np.uint64(at)] = MISS  # unsigned: no test whether the place is counted from the end
        other, at, height = _step(at, height, along, across, rise, run)
        flat[np.uint64(other)] = MISS
    for _ in range(body, steps):
        flat[at] = max(flat[at], GRAZE)
        other, at, height = _step(at, height, along, across, rise, run)
        flat[other] = max(flat[other], GRAZE)
    mark = GRAZE if grazing > 0 else MISS
    flat[at] = max(flat[at], mark)
    flat[last] = max(flat[last], mark)


@njit(cache=True)
def _mark(flat, columns, start, ends, hit, low, graze):
    x0, y0 = _quanta(start[0] - low[0]), _quanta(start[1] - low[1])
    for b in range(ends.shape[0]):
        grazing = graze + 1 if graze > 0 and hit[b] else 0
        _walk(flat, columns, x0, y0, _quanta(ends[b, 0] - low[0]), _quanta(ends[b, 1] - low[1]), grazing)
    for b in range(ends.shape[0]):
        if hit[b]:
            x1, y1 = _quanta(ends[b, 0] - low[0]), _quanta(ends[b, 1] - low[1])
            flat[(y1 // QUANTA) * columns + x1 // QUANTA] = HIT


@njit(cache=True)
def _look(rows, columns, start, ends, hit, graze):
    """(window, its first column and row)."""
    for b in range(ends.shape[0]):
        for a in range(2):
            if not abs(ends[b, a] - start[a]) <= MAX_LENGTH:
                raise ValueError(TOO_LONG)
    low, high = np.empty(2, np.int64), np.empty(2, np.int64)
    for a in range(2):
        least = most = start[a]
        for b in range(ends.shape[0]):
            least, most = min(least, ends[b, a]), max(most, ends[b, a])
        low[a], high[a] = np.int64(np.floor(least)) - 1, np.int64(np.floor(most)) + 2
    if low[0] < 0 or low[1] < 0 or high[0] > columns or high[1] > rows:
        raise ValueError(OUTSIDE)
    width, height = high[0] - low[0], high[1] - low[1]
    flat = np.zeros(height * width, np.uint8)
    _mark(flat, width, start, ends, hit, low, graze)
    return flat.reshape((height, width)), low


@kernel(LAYER, types.int64, given(1), given(2), given(1, types.boolean), given(1), types.float64)
def _apply_plain(log_odds, columns, start, ends, hit, evidence, bound):
    window, low = _look(log_odds.shape[0] // columns, columns, start, ends, hit, 0)
    miss_adds, hit_adds = evidence[0], evidence[1]
    for r in range(window.shape[0]):
        first = (r + low[1]) * columns + low[0]
        part = log_odds[first : first + window.shape[1]]
        for c in range(window.shape[1]):
            look = window[r, c]
            added = hit_adds if look == HIT else (miss_adds if look == MISS else 0.0)
            v = part[c] + added
            v = bound if v > bound else v
            part[c] = -bound if v < -bound else v


@unpacks(_apply_plain)
def apply_plain(log_odds, columns, beams, evidence, bound):
    """Twin of :func:`vslam_ref.grids.plain.apply_plain`."""
    _apply_plain(log_odds, columns, *beams, evidence, bound)


@njit(cache=True)
def _near_static(s, columns, row, column, reach):
    for r in range(max(row - reach, 0), min(row + reach + 1, s.shape[0] // columns)):
        for c in range(max(column - reach, 0), min(column + reach + 1, columns)):
            if s[r * columns + c] > DECIDED_LOG_ODDS:
                return True
    return False


@njit(cache=True)
def _continues_line(s, columns, row, column):
    for i in range(-1, 2):
        for j in range(-1, 2):
            r, c = row + 2 * i, column + 2 * j
            if (i != 0 or j != 0) and 0 <= r < s.shape[0] // columns and 0 <= c < columns:
                near, next_but_one = s[(row + i) * columns + column + j], s[r * columns + c]
                if near > DECIDED_LOG_ODDS and next_but_one > DECIDED_LOG_ODDS:
                    return True
    return False


@njit(cache=True)
def _state(log_odds):
    if log_odds > DECIDED_LOG_ODDS:
        return OCCUPIED
    return FREE if log_odds < -DECIDED_LOG_ODDS else UNKNOWN


@njit(cache=True)
def _clipped(v, bound):
    return min(max(v, -bound), bound)


@njit(cache=True)
def _explain(window, low, s, columns, reach, lines):
    """Flag hits that a static cell explains, and those that continue a line: before S changes."""
    for r in range(window.shape[0]):
        for c in range(window.shape[1]):
            if window[r, c] == HIT:
                row, column = r + low[1], c + low[0]
                explained = reach > 0 and _near_static(s, columns, row, column, reach)
                in_line = lines and _continues_line(s, columns, row, column)
                window[r, c] |= (EXPLAINED if explained else 0) | (IN_LINE if in_line else 0)


@kernel(
    LAYER, LAYER, LAYER, LAYER, LAYER, types.int64, given(1), given(2), given(1, types.boolean),
    given(2), given(2), *(types.float64,) * 6, types.int64, types.int64, types.float64,
)  # fmt: skip
def _apply_scan(
    s, d, seen, last_hit, since, columns, start, ends, hit,
    steps_s, steps_d, s_bound, d_bound, lifetime, settle, in_line, gap, reach, graze, now,
):  # fmt: skip
    window, low = _look(s.shape[0] // columns, columns, start, ends, hit, graze)
    if reach > 0 or in_line < settle:
        _explain(window, low, s, columns, reach, in_line < settle)
    for r in range(window.shape[0]):
        first = (r + low[1]) * columns + low[0]
        for c in range(window.shape[1]):
            look = window[r, c]
            if look == UNSEEN:
                continue
            at = first + c
            old = s[at]
            state = _state(old)
            is_hit = 1 if look >= HIT else 0
            if is_hit:
                unseen = now - seen[at]
                shifted = since[at] + (unseen if unseen > gap else 0.0)
                since[at] = now if last_hit[at] == -np.inf else shifted
                last_hit[at] = now
            elif now - last_hit[at] > gap:
                last_hit[at] = -np.inf
            if is_hit and state == FREE and now - since[at] >= (in_line if look & IN_LINE else settle):
                old, state = 0.0, UNKNOWN
            prior = 0.0 if now - seen[at] > lifetime else d[at]
            state = OCCUPIED if look & EXPLAINED else state
            kind = 2 if look == GRAZE else is_hit
            s[at] = _clipped(old + steps_s[state, kind], s_bound)
            d[at] = _clipped(prior + steps_d[state, kind], d_bound)
            seen[at] = now


@unpacks(_apply_scan)
def apply_scan(layers, columns, beams, rules, now):
    """Twin of :func:`vslam_ref.grids.static_dynamic.apply_scan`."""
    _apply_scan(*layers, columns, *beams, *rules, now)
