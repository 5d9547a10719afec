"""One parameter of one type brought to one temperature, one current and its siblings' common changes taken off."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.stats import chi2

from .robust import Array, Index, line, spread_of, tracks

COPPER_PER_K = 0.00393
_LEAST_K, _LEAST_LOG_A = 1.0, 0.03  # of scatter within motors: below, a slope is not sought
_LEAST_CELL = 5  # motors of a group in one week
_LEAST_COMMON = 0.01
_LEAST_SIZE = 0.25


@dataclasses.dataclass(frozen=True)
class Slope:
    """Relative change per kelvin, or per factor e of current."""

    value: float
    sd: float


@dataclasses.dataclass(frozen=True)
class Common:
    """What motors of one group did together, week by week, as parts of the value, and the chance of it."""

    key: str
    label: str
    parameter: str
    weeks: tuple[float, ...]
    change: tuple[float, ...]
    sd: tuple[float, ...]
    motors: int
    p: float
    square: float  # chi-square of the weeks' changes


def weeks_of(motor: Index, day: Array) -> Index:
    """Number of each window's period: the usual step of one motor's windows, from the first day on."""
    order = np.lexsort((day, motor))
    steps = np.diff(day[order])[np.diff(motor[order]) == 0]
    steps = steps[steps > 0]
    step = float(np.median(steps)) if steps.size else 1.0
    return np.asarray(np.round((day - np.min(day)) / step), dtype=np.intp)


def centred(motor: Index, x: Array, w: Array, motors: int) -> Array:
    """Values without each motor's weighted mean."""
    sums = np.bincount(motor, w, minlength=motors)
    return np.asarray(x - (np.bincount(motor, w * x, minlength=motors) / np.maximum(sums, 1e-300))[motor])


def scale_of(motor: Index, r: Array, s: Array, parameters: int) -> float:
    """By what the stated deviations s must be multiplied to be the scatter r of windows about their motor; 1 where too
    few motors have windows enough to tell."""
    many = np.bincount(motor)[motor] > parameters
    if np.count_nonzero(many) < 20:
        return 1.0
    return max(spread_of((r / s)[many], np.zeros(int(np.count_nonzero(many))), 0), 1e-6)


@dataclasses.dataclass(frozen=True)
class Brought:
    """Values at one temperature and current; deviations that a correction which could not be made adds (0 where it
    was made); the stated deviations' scale; the slopes that were used."""

    y: Array
    wide: Array
    scale: float
    slopes: dict[str, Slope]


def middle(x: Array) -> float:
    """Median of what is known; NaN where nothing is."""
    known = x[np.isfinite(x)]
    return float(np.median(known)) if known.size else float("nan")


def told_scale(motor: Index, r: Array, s: Array, wide: Array, parameters: int) -> float:
    """scale_of by windows that were brought to one point, where these are enough."""
    whole = wide == 0
    if np.count_nonzero(whole) < 20:
        return scale_of(motor, r, s, parameters)
    return scale_of(motor[whole], r[whole], s[whole], parameters)


def own_size(motor: Index, y: Array, s: Array, motors: int) -> Array:
    """Of each window, its motor's level as a part of the type's, 1 + y; no less than a quarter."""
    flat = tracks(motor, np.zeros(y.size), y, s, motors, flat=True)
    return np.asarray(np.maximum(1 + flat.level, _LEAST_SIZE)[motor])


def at_one_point(
    parameter: str, motor: Index, motors: int, y: Array, s: Array, temperature_C: Array, current_A: Array
) -> Brought:
    """Values y = x / type - 1 at the median temperature and current. Windows without one (NaN) stay where they are,
    and a motor's own have together no less deviation than the type's spread of it makes."""
    used: dict[str, Slope] = {}
    flat = tracks(motor, np.zeros(y.size), y, s, motors, flat=True)
    scale = scale_of(motor, flat.residual, s, 1)
    with np.errstate(invalid="ignore"):
        log_A = np.log(np.maximum(current_A, 1e-9))
    wanted = {"per_K": (temperature_C, _LEAST_K), "per_log_A": (log_A, _LEAST_LOG_A)}
    known = np.ones(y.size, dtype=bool)
    chosen: list[str] = []
    for name, (x, least) in wanted.items():
        at = known & np.isfinite(x)
        if not np.any(at):
            continue
        within = centred(motor[at], x[at], 1 / s[at] ** 2, motors)
        if float(np.std(within)) > least and np.count_nonzero(np.bincount(motor[at], minlength=motors) > 1) >= 5:
            chosen.append(name)
            known = at
    if chosen:
        weight = 1 / s[known] ** 2
        size = own_size(motor, y, s, motors)[known]
        X = np.column_stack([size * centred(motor[known], wanted[name][0][known], weight, motors) for name in chosen])
        found = line(X, centred(motor[known], y[known], weight, motors), scale * s[known])
        for k, name in enumerate(chosen):
            used[name] = Slope(float(found.b[k]), float(np.sqrt(found.covariance[k, k])))
    if parameter == "R_ohm" and "per_K" not in used and np.any(np.isfinite(temperature_C)):
        used["per_K"] = Slope(COPPER_PER_K, 0.0)
    wide2 = np.zeros(y.size)
    for name, slope in used.items():
        x = wanted[name][0]
        has = np.isfinite(x)
        by = np.clip(1 + slope.value * (x[has] - middle(x)), 0.2, 5.0)
        y = y.copy()
        y[has] = (1 + y[has]) / by - 1
        # What a motor's windows lack is one and the same for all of them: not less for being many.
        lacking = np.bincount(motor[~has], minlength=motors)[motor]
        spread = 1.4826 * middle(np.abs(x - middle(x)))
        wide2 += np.where(has, 0.0, lacking * (slope.value * spread) ** 2)
    wide = np.sqrt(wide2)
    if np.any(wide > 0):
        wide = wide * own_size(motor, y, np.hypot(s, wide), motors)
    flat = tracks(motor, np.zeros(y.size), y, np.hypot(s, wide), motors, flat=True)
    return Brought(y, wide, told_scale(motor, flat.residual, s, wide, 1), used)


def common_changes(
    parameter: str,
    key: str,
    group: Index,
    labels: list[str],
    motor: Index,
    motors: int,
    week: Index,
    day: Array,
    y: Array,
    s: Array,
) -> tuple[list[Common], Array]:
    """Groups whose motors change together against all others, and what to take off each window for it.

    group[motors] is the label's index or -1; y may be of several types, since each motor is its own reference.
    """
    total = np.zeros(y.size)
    found: list[Common] = []
    # The one that is least by chance first: the others then stand against a fleet without it.
    while True:
        c, off = _most_common(parameter, key, group, labels, motor, motors, week, day, y - total, s)
        if c is None or c.p * max(1, len(labels)) > 1e-3 or np.ptp(c.change) < _LEAST_COMMON:
            return found, total
        if any(f.label == c.label for f in found):
            return found, total
        found.append(c)
        total = total + off


def _most_common(
    parameter: str,
    key: str,
    group: Index,
    labels: list[str],
    motor: Index,
    motors: int,
    week: Index,
    day: Array,
    y: Array,
    s: Array,
) -> tuple[Common | None, Array]:
    off = np.zeros(y.size)
    best: Common | None = None
    r = centred(motor, y, 1 / s**2, motors)
    of = group[motor]
    for w in np.unique(week):
        here = week == w
        r[here] -= np.median(r[here])
    for k, label in enumerate(labels):
        mine = of == k
        weeks = [w for w in np.unique(week[mine]) if np.count_nonzero(mine & (week == w)) >= _LEAST_CELL]
        if len(weeks) < 3:
            continue
        cells = [r[mine & (week == w)] for w in weeks]
        change = np.array([np.median(c) for c in cells])
        # Each window's change has its week's median taken off: what is left is noise.
        left = np.concatenate([c - m for c, m in zip(cells, change, strict=False)])
        noise = 1.4826 * float(np.median(np.abs(left)))
        if noise <= 0:
            continue
        sd = 1.2533 * noise / np.sqrt([c.size for c in cells])
        square = float(np.sum(((change - np.mean(change)) / sd) ** 2))
        if best is not None and square <= best.square:
            continue
        days = tuple(float(np.median(day[mine & (week == w)])) for w in weeks)
        best = Common(
            key,
            label,
            parameter,
            days,
            tuple(map(float, change)),
            tuple(map(float, sd)),
            int(np.unique(motor[mine]).size),
            float(chi2.sf(square, len(weeks) - 1)),
            square,
        )
        off = np.zeros(y.size)
        for w, c in zip(weeks, change, strict=False):
            off[mine & (week == w)] = c
    return best, off
