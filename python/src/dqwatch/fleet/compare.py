"""What one motor alone cannot tell: who stands out in a fleet, who drifts, which batch is unlike the others."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student

from .adjust import Common, Slope, at_one_point, common_changes, middle, own_size, told_scale, weeks_of
from .naming import SAYS, Offs, named
from .robust import Array, Index, Tracks, crossing, location, of_others, spread_of, tracks
from .windows import D_AXIS, PARAMETERS, Windows

FALSE_DISCOVERIES = 0.01
LIMIT = 0.10  # of a type's value: where a drift is said to cross
# What is worth a look, relative: a level, a drift over the time seen. Less is real or not, and nobody's concern.
_WORTH = {
    "R_ohm": (0.05, 0.02),
    "Ld_H": (0.05, 0.02),
    "Lq_H": (0.05, 0.02),
    "psi_Wb": (0.02, 0.01),
    "dead_time_V": (0.10, 0.05),
    "J_kgm2": (0.10, 0.05),
    "B_Nms_rad": (0.30, 0.30),
    "coulomb_Nm": (0.30, 0.30),
    D_AXIS: (0.5, 0.5),
}
# Types are compared at their own temperature and current, on their own inverter: by so much the same motor may differ.
_LIKE = {"R_ohm": 0.12, "Lq_H": 0.06, "psi_Wb": 0.04}
_CLEAR = 5.0  # deviations from none
_MACHINE, _FAR = ("R_ohm", "Lq_H", "psi_Wb"), 5.0
_LEAST_SIZE = 0.25  # of a type's value: what is less is no measure of others
_LEAST_MOTORS = 5  # of a type, to be compared
_GROUPED = ("batch", "axis", "site")
_COMMON = ("site", "axis")


@dataclasses.dataclass(frozen=True)
class Of:
    """One parameter of one type: location at one temperature and current, spread over motors, and each motor in it."""

    type: str
    parameter: str
    value: float
    sd: float
    spread: float
    drift: float
    slopes: dict[str, Slope]
    temperature_C: float
    current_A: float
    scale: float
    motors: Index
    off: Array  # of each motor, relative; of D_AXIS a logarithm
    off_sd: Array  # its own
    z: Array
    slope: Array  # relative, a day, against the type's
    slope_sd: Array
    slope_z: Array
    span: Array
    day: Array
    shift: Array  # of each motor's group, where that is unlike the others: taken off before it is judged
    window: Index  # of the windows' table
    y: Array  # of each window, relative to the type's location
    size: float  # what is relative is a part of this


@dataclasses.dataclass(frozen=True)
class Sign:
    """One test that a motor does not pass."""

    parameter: str
    what: str  # "level" or "drift"
    off: float  # relative; a drift's over the time seen
    sd: float
    z: float
    q: float


@dataclasses.dataclass(frozen=True)
class Standing:
    """A motor that stands out: why, by which signs, and when a drift crosses its limit (days, with 95 %)."""

    motor: str
    type: str
    cause: str
    says: str
    also: tuple[str, ...]
    signs: tuple[Sign, ...]
    like: str = ""
    crossing: tuple[str, float, float, float] | None = None


@dataclasses.dataclass(frozen=True)
class Unlike:
    """A batch, axis or site whose motors are unlike the type's others."""

    key: str
    label: str
    type: str
    parameter: str
    off: float
    sd: float
    z: float
    q: float
    motors: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Comparison:
    """All that is told of a fleet: types, who stands out, groups, common changes, and how many tests there were."""

    of: list[Of]
    standing: list[Standing]
    unlike: list[Unlike]
    common: list[Common]
    tests: int
    uncorrected: dict[str, int]  # windows with R, L or flux that lack "temperature", "current"
    not_compared: list[tuple[str, str]]  # motor and parameter, where too few have its firmware
    alone: int = 0  # motors of which nothing is compared


def discovered(p: Array) -> Array:
    """Benjamini and Hochberg's q of each p."""
    if p.size == 0:
        return p
    order = np.argsort(p)
    q = p[order] * p.size / np.arange(1, p.size + 1)
    q = np.minimum.accumulate(q[::-1])[::-1]
    out = np.empty(p.size)
    out[order] = np.minimum(q, 1.0)
    return out


@dataclasses.dataclass
class _Part:
    """One parameter of one type while it is worked on."""

    type: int
    parameter: str
    window: Index
    motor: Index  # of each window
    y: Array
    s: Array
    slopes: dict[str, Slope]
    temperature_C: float
    current_A: float
    scale: float
    wide: Array  # deviation of each window for what it was not corrected by
    size: float  # y = value / size - 1; NaN where y is a logarithm


def _size(motor: Index, x: Array, s: Array, motors: int) -> float:
    """The type's value without its sign, robustly over its motors; its own deviation where it is less than that."""
    unit = float(np.median(s))
    flat = tracks(motor, np.zeros(x.size), x / unit, s / unit, motors, flat=True)
    some = np.unique(motor)
    found = location(flat.level[some], flat.level_sd[some])
    return unit * max(abs(found.value), found.sd)


def _parts(w: Windows) -> list[_Part]:
    out = []
    kind = w.group["type"]
    n = len(w.motors)
    for g in range(-1, len(w.labels["type"])):
        for p in (*PARAMETERS, D_AXIS):
            value, sd = w.value[p], w.sd[p]
            with np.errstate(invalid="ignore"):
                at = np.flatnonzero((kind[w.motor] == g) & np.isfinite(value) & (sd > 0) & np.isfinite(sd))
                if p == D_AXIS:
                    at = at[value[at] > 0]
            if np.unique(w.motor[at]).size < _LEAST_MOTORS:
                continue
            motor = w.motor[at]
            if p == D_AXIS:
                size, y, s = float("nan"), np.log(value[at]), sd[at] / value[at]
            else:
                size = _size(motor, value[at], sd[at], n)
                y, s = value[at] / size - 1, sd[at] / size
            T, i = w.temperature_C[at], w.current_A[at]
            if p == D_AXIS:
                T, i = np.full(at.size, np.nan), np.full(at.size, np.nan)
            b = at_one_point(p, motor, n, y, s, T, i)
            out.append(_Part(g, p, at, motor, b.y, s, b.slopes, middle(T), middle(i), b.scale, b.wide, size))
    return out


def _deviations(part: _Part) -> Array:
    return np.asarray(np.hypot(part.s * part.scale, part.wide))


def _take_common(w: Windows, parts: list[_Part]) -> list[Common]:
    found: list[Common] = []
    week = weeks_of(w.motor, w.day)
    n = len(w.motors)
    for p in sorted({part.parameter for part in parts} - {D_AXIS}):
        mine = [part for part in parts if part.parameter == p]
        at = np.concatenate([part.window for part in mine])
        for key in _COMMON:
            # What a group does together multiplies each motor's own.
            own = np.concatenate([own_size(part.motor, part.y, _deviations(part), n) for part in mine])
            y = (1 + np.concatenate([part.y for part in mine])) / own - 1
            s = np.concatenate([_deviations(part) for part in mine]) / own
            common, off = common_changes(p, key, w.group[key], w.labels[key], w.motor[at], n, week[at], w.day[at], y, s)
            found += common
            begin, off = 0, off * own
            for part in mine:
                part.y = part.y - off[begin : begin + part.y.size]
                begin += part.y.size
    return found


def _tracks(w: Windows, part: _Part) -> Tracks:
    """With deviations as the windows scatter, and no less than a motor's own do."""
    n = len(w.motors)
    day = w.day[part.window]
    first = tracks(part.motor, day, part.y, _deviations(part), n)
    part.scale = told_scale(part.motor, first.residual, part.s, part.wide, 2)
    s = _deviations(part)
    found = tracks(part.motor, day, part.y, s, n)
    free = np.maximum(found.windows - 2, 0)
    square = np.bincount(part.motor, np.minimum((found.residual / s) ** 2, 25.0), minlength=n)
    # A few windows hardly tell a motor's own scatter: the fleet's counts as six.
    wide = np.sqrt(np.maximum(1.0, (square * free / np.maximum(found.windows, 1) + 6) / (free + 6)))
    return dataclasses.replace(found, level_sd=found.level_sd * wide, slope_sd=found.slope_sd * wide)


def _between(level: Array, firmware: Index, without: int) -> float:
    """Deviation between firmwares that two or more motors have, one motor left out; NaN for fewer than two of them."""
    rest = np.arange(level.size) != without
    said = [firmware == f for f in np.unique(firmware[firmware >= 0])]
    values = [float(np.median(level[at & rest])) for at in said if np.count_nonzero(at & rest) >= 2]
    return float(np.std(values, ddof=1)) if len(values) >= 2 else float("nan")


def _by_firmware(w: Windows, part: _Part, t: Tracks, members: Index) -> Array:
    """What an inverter loses is its firmware's, and R is never quite without it: brings each firmware's windows to the
    type's. Gives the deviation between firmwares for motors whose own too few have; NaN where that is not told."""
    wide = np.zeros(len(w.motors))
    if part.parameter not in ("dead_time_V", "R_ohm"):
        return wide
    whole = location(t.level[members], t.level_sd[members]).value
    firmware = w.group["firmware"][members]
    for f in np.unique(firmware[firmware >= 0]):
        mine = members[firmware == f]
        if mine.size >= _LEAST_MOTORS:
            base = location(t.level[mine], t.level_sd[mine]).value
            at = np.isin(part.motor, mine)
            if min(1 + base, 1 + whole) > _LEAST_SIZE:
                by = np.where(at, (1 + whole) / (1 + base), 1.0)
                part.y, part.s, part.wide = (1 + part.y) * by - 1, part.s * by, part.wide * by
            else:
                part.y = part.y - np.where(at, base - whole, 0.0)
            continue
        for m in mine:
            wide[m] = _between(t.level[members], firmware, int(np.flatnonzero(members == m)[0]))
    return wide


def _unlike(w: Windows, part: _Part, level: Array, sd: Array, members: Index) -> list[tuple[Unlike, Index]]:
    found: list[tuple[Unlike, Index]] = []
    for key in _GROUPED:
        group = w.group[key][members]
        labels = [g for g in np.unique(group[group >= 0]) if np.count_nonzero(group == g) >= _LEAST_MOTORS]
        if len(labels) < 4:
            continue
        each = [members[group == g] for g in labels]
        # The median: of five, two may be what no batch is the reason of.
        value = np.array([np.median(level[mine]) for mine in each])
        # Within groups: what one is off by is no spread of the motors.
        of_group = np.concatenate(each)
        within = spread_of(
            np.concatenate([level[mine] - v for mine, v in zip(each, value, strict=False)]), sd[of_group], len(labels)
        )
        own = 1.2533 * np.sqrt([np.mean(sd[mine] ** 2 + within**2) / mine.size for mine in each])
        others, others_sd, spread = of_others(value, own)
        total = np.sqrt(own**2 + spread**2 + others_sd**2)
        for g, mine, v, s in zip(labels, each, value - others, total, strict=False):
            # The spread between few groups is little known, and the rest by the motors: eight stand for that.
            p = 2 * float(student.sf(abs(v) / s, max(0.6 * len(labels) - 1, 8)))
            found.append(
                (
                    Unlike(
                        key,
                        w.labels[key][g],
                        "" if part.type < 0 else w.labels["type"][part.type],
                        part.parameter,
                        float(v),
                        float(s),
                        float(v / s),
                        p,
                        tuple(w.motors[k] for k in mine),
                    ),
                    mine,
                )
            )
    return found


def _place(w: Windows, part: _Part, t: Tracks, level: Array, shift: Array, members: Index, core: Index) -> Of:
    """Location by the motors of `core`; every one of `members` in it."""
    whole = location(level[core], t.level_sd[core])
    own = t.level_sd[members]
    # Locations are the type's size but for what windows that scatter leave.
    part_of = 1.0 if part.parameter == D_AXIS else max(abs(1 + whole.value), whole.sd)
    off = (level[members] - whole.value) / part_of
    others, others_sd, spread = (
        np.full(members.size, whole.value),
        np.full(members.size, whole.sd),
        np.full(members.size, whole.spread),
    )
    if core.size == members.size:
        others, others_sd, spread = of_others(level[members], own)
    z = (level[members] - others) / np.sqrt(own**2 + spread**2 + others_sd**2)
    slope, slope_sd = t.slope[members].copy(), t.slope_sd[members].copy()
    slope_z = np.full(members.size, np.nan)
    drift = 0.0
    has = np.isfinite(slope)
    if np.count_nonzero(has) >= _LEAST_MOTORS:
        all_slopes = location(slope[has], slope_sd[has])
        drift = all_slopes.value
        slope -= drift
        slope_sd = np.sqrt(slope_sd**2 + all_slopes.spread**2 + all_slopes.sd**2)
        slope_z = slope / slope_sd
    keep = np.isin(part.motor, members)
    return Of(
        "" if part.type < 0 else w.labels["type"][part.type],
        part.parameter,
        float(np.exp(whole.value)) if part.parameter == D_AXIS else part.size * (1 + whole.value),
        whole.sd / part_of,
        whole.spread / part_of,
        drift / part_of,
        part.slopes,
        part.temperature_C,
        part.current_A,
        part.scale,
        members,
        off,
        own / part_of,
        z,
        slope / part_of,
        slope_sd / part_of,
        slope_z,
        t.span[members],
        t.day[members],
        shift[members] / part_of,
        part.window[keep],
        (part.y[keep] - whole.value) / part_of,
        part.size * part_of,
    )


def _signs(of: list[Of]) -> tuple[list[list[Sign]], int]:
    """For each Of and motor its failed tests; how many tests there were."""
    rows: list[tuple[int, int, str, float, float, float]] = []
    for k, o in enumerate(of):
        for j in range(o.motors.size):
            if np.isfinite(o.z[j]) and not (o.parameter == D_AXIS and o.z[j] < 0):
                rows.append((k, j, "level", float(o.off[j]), float(np.hypot(o.off_sd[j], o.spread)), float(o.z[j])))
            if np.isfinite(o.slope_z[j]) and o.parameter != D_AXIS:
                span = float(o.span[j])
                rows.append((k, j, "drift", float(o.slope[j] * span), float(o.slope_sd[j] * span), float(o.slope_z[j])))
    z = np.array([row[5] for row in rows])
    # A spread that some motors tell is uncertain itself; the clipped ones tell less.
    free = np.array([max(0.6 * of[row[0]].motors.size - 1, 2) for row in rows])
    q = discovered(2 * student.sf(np.abs(z), free) if z.size else z)
    found: list[list[Sign]] = [[] for _ in range(1 + max((int(m) for o in of for m in o.motors), default=-1))]
    for (k, j, what, off, sd, zj), qj in zip(rows, q, strict=False):
        p = of[k].parameter
        if qj < FALSE_DISCOVERIES and abs(off) >= _WORTH[p][what == "drift"]:
            found[int(of[k].motors[j])].append(Sign(p, what, off, sd, zj, float(qj)))
    return found, len(rows)


def _offs(of: list[Of], m: int) -> Offs:
    levels: tuple[dict[str, float], dict[str, float]] = ({}, {})
    drifts: tuple[dict[str, float], dict[str, float]] = ({}, {})
    for o in of:
        at = np.flatnonzero(o.motors == m)
        if at.size == 0:
            continue
        j = int(at[0])
        off, sd = float(o.off[j]), float(np.sqrt(o.off_sd[j] ** 2 + o.spread**2 + o.sd**2))
        # Causes are factors: logarithms, where a value is far enough from none.
        size = 1 + off if o.parameter != D_AXIS and 1 + off > _CLEAR * float(o.off_sd[j]) else 1.0
        levels[0][o.parameter] = off if size == 1 else float(np.log(size))
        levels[1][o.parameter] = sd / size
        if np.isfinite(o.slope_z[j]) and o.parameter != D_AXIS and o.span[j] > 0:
            drifts[0][o.parameter] = float(o.slope[j] * o.span[j]) / size
            drifts[1][o.parameter] = float(o.slope_sd[j] * o.span[j]) / size
    return [levels, drifts]


def _far(of: list[Of], m: int) -> bool:
    """Two of R, L and flux are far from the type's."""
    far = [abs(float(o.z[o.motors == m][0])) > _FAR for o in of if o.parameter in _MACHINE and m in o.motors]
    return sum(far) >= 2


def _other_type(w: Windows, of: list[Of], m: int, kind: str) -> str:
    """The type that this motor's R, L and flux are those of, where they are not its own type's; "" for none.

    Flux and L that were found with the pole pairs of the papers are taken times those.
    """
    mine = {o.parameter: (o, int(np.flatnonzero(o.motors == m)[0])) for o in of if m in o.motors}
    best, best_p = "", 1e-4
    for other in w.labels["type"]:
        theirs = {o.parameter: o for o in of if o.type == other}
        if other == kind:
            continue
        like = np.flatnonzero(w.group["type"] == w.labels["type"].index(other))
        poles = float(np.nanmedian(w.pole_pairs[like]))
        square, count = 0.0, 0
        for p in _MACHINE:
            if p not in mine or p not in theirs:
                continue
            o, j = mine[p]
            if min(1 + float(o.off[j]), o.value, theirs[p].value) <= 0:
                continue
            x = float(np.log1p(o.off[j]) + np.log(o.value))
            if p != "R_ohm":
                x += float(np.log(w.pole_pairs[m] / poles))
            x -= float(np.log(theirs[p].value))
            square += x * x / (theirs[p].spread ** 2 + float(o.off_sd[j] / (1 + o.off[j])) ** 2 + _LIKE[p] ** 2)
            count += 1
        if count >= 2 and (p_like := float(chi2.sf(square, count))) > best_p:
            best, best_p = other, p_like
    return best


def _crossing(w: Windows, of: list[Of], m: int, signs: tuple[Sign, ...]) -> tuple[str, float, float, float] | None:
    """Of the drift that crosses first: parameter, day and interval; from -inf to its first window where it is past the
    limit before that."""
    first: tuple[str, float, float, float] | None = None
    for o in of:
        if not any(s.what == "drift" and s.parameter == o.parameter for s in signs) or m not in o.motors:
            continue
        j = int(np.flatnonzero(o.motors == m)[0])
        limit = np.sign(o.slope[j]) * LIMIT
        at, low, high = crossing(float(o.off[j]), float(o.off_sd[j]), float(o.slope[j]), float(o.slope_sd[j]), limit)
        day = float(o.day[j])
        begin = float(np.min(w.day[o.window[w.motor[o.window] == m]]))
        if day + at < begin:
            at, low, high = -np.inf, -np.inf, begin - day
        if at < np.inf and (first is None or day + at < first[1]):
            first = (o.parameter, float(day + at), day + low, day + high)
    return first


def _uncorrected(w: Windows) -> dict[str, int]:
    with np.errstate(invalid="ignore"):
        electrical = np.any([w.sd[p] > 0 for p in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb")], axis=0)
    lacks = {"temperature": w.temperature_C, "current": w.current_A}
    return {name: int(np.count_nonzero(electrical & ~np.isfinite(x))) for name, x in lacks.items()}


def left_out(c: Comparison) -> list[str]:
    """What was not corrected and not compared, a line each."""
    lines = [
        f"{count} windows are without {name} and not brought to one {name}"
        for name, count in c.uncorrected.items()
        if count
    ]
    if c.alone:
        lines.append(f"{c.alone} motors are not compared: nothing is told of them, or of fewer than five of their type")
    for p in dict.fromkeys(p for _m, p in c.not_compared):
        some = [m for m, of in c.not_compared if of == p]
        shown = ", ".join(some[:5]) + (", …" if len(some) > 5 else "")
        lines.append(f"{p} of {len(some)} motors is not compared, too few have their firmware: {shown}")
    return lines


def compare(w: Windows) -> Comparison:
    """Compares motors of a type with each other; false discoveries of motors are held at 1 % over the fleet."""
    parts = _parts(w)
    common = _take_common(w, parts)
    done: list[tuple[_Part, Tracks, Array, Index]] = []
    groups: list[tuple[Unlike, Index, int]] = []
    not_compared: list[tuple[str, str]] = []
    for part in parts:
        t = _tracks(w, part)
        members = np.unique(part.motor)
        wide = _by_firmware(w, part, t, members)
        t = _tracks(w, part)
        t = dataclasses.replace(t, level_sd=np.hypot(t.level_sd, wide))
        level = t.level
        told = np.isfinite(t.level_sd[members])
        not_compared += [(w.motors[m], part.parameter) for m in members[~told]]
        members = members[told]
        if members.size < _LEAST_MOTORS:
            continue
        done.append((part, t, level, members))
        if part.parameter != D_AXIS:
            groups += [(u, mine, len(done) - 1) for u, mine in _unlike(w, part, level, t.level_sd, members)]
    q = discovered(np.array([u.q for u, _m, _k in groups]))
    real = [
        (dataclasses.replace(u, q=float(x)), mine, k)
        for (u, mine, k), x in zip(groups, q, strict=False)
        if x < FALSE_DISCOVERIES and abs(u.off) >= _WORTH[u.parameter][0]
    ]
    of: list[Of] = []
    of_batch: dict[int, Unlike] = {}
    for k, (part, t, level, members) in enumerate(done):
        shift = np.zeros(level.size)
        for u, mine, at in real:
            if at == k:
                shift[mine] += u.off
                if u.key == "batch":
                    of_batch.update({int(m): u for m in mine})
        level = level - shift
        core = members[shift[members] == 0]
        of.append(_place(w, part, t, level, shift, members, core if core.size >= _LEAST_MOTORS else members))
    signs, tests = _signs(of)
    standing: list[Standing] = []
    warm_known = {int(m) for m in w.motor[np.isfinite(w.temperature_C)]}
    by_type: dict[str, list[Of]] = {}
    for o in of:
        by_type.setdefault(o.type, []).append(o)
    for m, failed in enumerate(signs):
        kind = "" if w.group["type"][m] < 0 else w.labels["type"][w.group["type"][m]]
        mine_of = by_type.get(kind, [])
        if failed:
            verdict = named(_offs(mine_of, m), m in warm_known)
            cause, also, like, says = verdict.name, verdict.also, "", verdict.says
            if _far(mine_of, m):
                like = _other_type(w, of, m, kind)
            if like:
                cause, also, says = "other_type", (), SAYS["other_type"]
            ordered = tuple(sorted(failed, key=lambda s: -abs(s.z)))
            standing.append(
                Standing(w.motors[m], kind, cause, says, also, ordered, like, _crossing(w, mine_of, m, ordered))
            )
        elif m in of_batch:
            u = of_batch[m]
            standing.append(
                Standing(
                    w.motors[m],
                    kind,
                    "batch",
                    SAYS["batch"],
                    (),
                    (Sign(u.parameter, "level", u.off, u.sd, u.z, u.q),),
                    u.label,
                )
            )
    standing.sort(key=lambda s: -max(abs(x.z) for x in s.signs))
    alone = len(w.motors) - np.unique(np.concatenate([[], *(o.motors for o in of)])).size
    return Comparison(of, standing, [u for u, _m, _k in real], common, tests, _uncorrected(w), not_compared, alone)
