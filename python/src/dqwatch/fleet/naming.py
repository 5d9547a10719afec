"""What a pattern of parameters that are unlike the others' says: each cause moves its own, by one common factor."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import chi2


@dataclasses.dataclass(frozen=True)
class Cause:
    """By how much each logarithm moves with one unit of the cause. What `frees` names may go anywhere with it."""

    name: str
    says: str
    moves: Mapping[str, float]
    sign: int = 0  # of its amount; 0: either
    frees: tuple[str, ...] = ()


_DRAGS = "friction is high: a bearing, a seal or a brake that drags"
# From the voltage equations: i read g times too large makes R and L 1/g, v too large all of them, the speed psi and L.
CAUSES = (
    Cause("weak_magnet", "the flux is low: the magnets are weak, or were too hot", {"psi_Wb": -1}, 1),
    Cause("strong_magnet", "the flux is high: other magnets or another winding", {"psi_Wb": 1}, 1),
    Cause(
        "current_sensor",
        "the current sensors' gain",
        {"R_ohm": -1, "Lq_H": -1, "Ld_H": -1},
    ),
    Cause(
        "voltage_sensor",
        "the voltage's gain",
        {"R_ohm": 1, "Lq_H": 1, "Ld_H": 1, "psi_Wb": 1, "dead_time_V": 1},
    ),
    Cause(
        "encoder_scale",
        "the speed's scale",
        {"psi_Wb": -1, "Lq_H": -1, "Ld_H": -1},
    ),
    Cause(
        "encoder_zero",
        "the magnet's flux shows on the d axis: the encoder's zero",
        {"d_axis": 1},
        1,
        ("R_ohm", "Lq_H", "Ld_H", "dead_time_V", "psi_Wb"),
    ),
    Cause("worn_bearing", _DRAGS, {"B_Nms_rad": 1, "coulomb_Nm": 1}, 1),
    # Not by one factor where it is dry, or thick with cold grease.
    Cause("worn_bearing", _DRAGS, {"coulomb_Nm": 1}, 1, ("B_Nms_rad",)),
    Cause("worn_bearing", _DRAGS, {"B_Nms_rad": 1}, 1, ("coulomb_Nm",)),
    Cause("low_friction", "friction is low: no load, or another bearing", {"B_Nms_rad": -1, "coulomb_Nm": -1}, 1),
    Cause("winding", "R is high and nothing else that is measured: a connection or the winding", {"R_ohm": 1}, 1),
    Cause(
        "low_resistance",
        "R is low and nothing else that is measured: a parallel path, another winding",
        {"R_ohm": -1},
        1,
    ),
    Cause("inductance", "L alone: the iron or the air gap", {"Lq_H": 1, "Ld_H": 1}),
    Cause("inverter", "what the inverter loses alone: dead time, or its compensation", {"dead_time_V": 1}),
    Cause("inertia", "the inertia alone: another load on the shaft", {"J_kgm2": 1}),
)
SAYS = {cause.name: cause.says for cause in CAUSES} | {
    "batch": "its whole batch is unlike the others",
    "other_type": "it is not of the type that its papers name",
    "unknown": "unlike the others, and no single cause fits",
    "heat": "a winding that is warmer than the others'",
}
_TIED = "unlike the others; what would tell the causes apart is not measured"
_CALLED = {"R_ohm": "R", "Ld_H": "L_d", "Lq_H": "L_q", "psi_Wb": "the flux", "dead_time_V": "dead time"}
_DOUBT = 6.0  # of chi-square: a cause as near as that is named beside
_SURE = 4.0  # deviations of its own sign that a cause needs which frees others
_WARM = 2.0  # deviations by which R is high where heat may be why
_LEFT = 1e-4  # chance below which what a cause leaves is not chance


@dataclasses.dataclass(frozen=True)
class Verdict:
    """The cause, its amount (in logarithms), and others that fit about as well. `says` speaks of what is measured."""

    name: str
    amount: float
    also: tuple[str, ...]
    left: float
    says: str


def amount_of(cause: Cause, off: Mapping[str, float], sd: Mapping[str, float]) -> tuple[float, float, float]:
    """Amount, its deviation, and chi-square of all that the cause does not free, with it."""
    names = [n for n in off if n not in cause.frees]
    a = np.array([cause.moves.get(n, 0.0) for n in names])
    r = np.array([off[n] for n in names])
    w = 1 / np.array([sd[n] for n in names]) ** 2
    power = float(np.sum(w * a * a))
    if power == 0:
        return 0.0, np.inf, float(np.sum(w * r * r))
    x = float(np.sum(w * a * r)) / power
    if cause.sign and x * cause.sign < 0:
        x = 0.0
    return x, power**-0.5, float(np.sum(w * (r - a * x) ** 2))


#: For levels and for drifts, how far each parameter is off, and its deviation.
Offs = Sequence[tuple[Mapping[str, float], Mapping[str, float]]]


def _text(name: str, offs: Offs) -> str:
    """The cause in words; where it is a factor, with what is measured that it moves, and what it does not."""
    cause = next((c for c in CAUSES if c.name == name), None)
    if name not in ("current_sensor", "voltage_sensor", "encoder_scale") or cause is None:
        return SAYS[name]
    known = [n for n in _CALLED if any(n in off for off, _sd in offs)]
    moved = [_CALLED[n] for n in known if n in cause.moves]
    still = [_CALLED[n] for n in known if n not in cause.moves and n != "dead_time_V"]
    text = f"{', '.join(moved)} moved" + (" by one factor" if len(moved) > 1 else "")
    if still:
        text += f", {', '.join(still)} did not"
    return f"{text}: {cause.says}"


def _warm(offs: Offs) -> bool:
    return any(off.get("R_ohm", 0.0) > _WARM * sd["R_ohm"] for off, sd in offs if "R_ohm" in sd)


def named(offs: Offs, temperature_known: bool = True) -> Verdict:
    """The cause that fits best. `offs`: for levels and for drifts, how far each parameter is off, and its deviation.

    Causes that move all that is measured alike are `unknown`, and stand beside it. Heat stands beside where R is high
    and no temperature is known.
    """
    found: list[tuple[float, float, float, str, dict[str, float]]] = []
    known = {n for off, _sd in offs for n in off}
    for cause in CAUSES:
        rest, freed, largest, surest = 0.0, 0, 0.0, 0.0
        for off, sd in offs:
            x, x_sd, left = amount_of(cause, off, sd)
            rest += left
            surest = max(surest, abs(x) / x_sd)
            freed += (x != 0) + sum(n in cause.frees for n in off)
            if abs(x) > abs(largest):
                largest = x
        # What is freed may not win by being many, and not without what the cause itself moves.
        if cause.frees and surest < _SURE:
            continue
        moved = {n: by * float(np.sign(largest)) for n, by in cause.moves.items() if n in known}
        found.append((rest + 4 * freed, rest, largest, cause.name, moved))
    found.sort(key=lambda f: f[:4])
    score, rest, amount, name, moved = found[0]
    near = [(n, way) for s, _r, x, n, way in found[1:] if x != 0 and n != name and s < score + _DOUBT]
    also = tuple(dict.fromkeys(n for n, _way in near))
    tied = any(way == moved for _n, way in near)
    warm = ("heat",) if not temperature_known and _warm(offs) else ()
    judged = max(1, sum(len(off) for off, _sd in offs) - 1)
    left = float(chi2.sf(rest, judged))
    # A part in ten of what was off may stay: neither made nor modelled exactly.
    all_off = sum(sum((off[n] / sd[n]) ** 2 for n in off) for off, sd in offs)
    if amount == 0:
        return Verdict("unknown", 0.0, warm, left, SAYS["unknown"])
    if left < _LEFT and rest > 0.1 * all_off:
        return Verdict("unknown", amount, (*warm, name, *also), left, SAYS["unknown"])
    if tied:
        return Verdict("unknown", amount, (*warm, name, *also), left, _TIED)
    return Verdict(name, amount, (*warm, *also), left, _text(name, offs))
