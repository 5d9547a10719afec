"""What a run prints: who stands out and why, then the groups."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .compare import Sign, Standing, left_out
from .windows import D_AXIS

if TYPE_CHECKING:
    from .api import FleetResult

_MOST, _MOST_LOST = 40, 5
_LOST = ("not_read", "not_fitted", "nothing")
_SHORT = {
    "R_ohm": "R",
    "Ld_H": "L_d",
    "Lq_H": "L_q",
    "psi_Wb": "ψ",
    "dead_time_V": "dead time",
    "J_kgm2": "J",
    "B_Nms_rad": "B",
    "coulomb_Nm": "friction",
    D_AXIS: "rest on d",
}


def sign_text(s: Sign) -> str:
    """One test, in words."""
    if s.parameter == D_AXIS:
        return f"rest on d × {math.exp(s.off):.1f}"
    change = f"{_SHORT[s.parameter]} {100 * s.off:+.1f} %"
    return change + (" (drift)" if s.what == "drift" else f" ± {100 * s.sd:.1f}")


def _date(day: float) -> str:
    import datetime

    if not math.isfinite(day) or not 0 <= day < 2.9e6:
        return "–"
    return (datetime.date(1970, 1, 1) + datetime.timedelta(days=int(day))).isoformat()


def due_text(s: Standing) -> str:
    """When a drift crosses 10 %, or that it was past before the first window; "" for none."""
    if s.crossing is None:
        return ""
    _parameter, at, low, high = s.crossing
    if not math.isfinite(at):
        return f"past 10 % before the first window ({_date(high)})"
    return f"10 % {_date(at)} ({_date(low)} … {_date(high)})"


def _shown(line: str) -> str:
    """Names come from logs: what a terminal would obey is spelt."""
    return "".join(x if x.isprintable() else ascii(x)[1:-1] for x in line)


def text_of(result: FleetResult) -> str:
    """The whole text."""
    c, table = result.comparison, result.windows
    motors = len(set(table["motor"].to_pylist()))
    lost = sum(v in _LOST for v in table["verdict"].to_pylist())
    lines = [
        f"{motors} motors, {table.num_rows} windows ({result.new} files new, {lost} not usable); "
        f"{len(c.standing)} stand out",
        "",
    ]
    rows = [
        (
            s.motor,
            s.type,
            s.cause.replace("_", " ") + (f" ({s.like})" if s.like else ""),
            ", ".join(map(sign_text, s.signs[:3])),
            due_text(s),
        )
        for s in c.standing[:_MOST]
    ]
    widths = [max((len(r[k]) for r in rows), default=0) for k in range(4)]
    lines += [("  ".join(x.ljust(n) for x, n in zip(r, (*widths, 0), strict=False))).rstrip() for r in rows]
    if len(c.standing) > _MOST:
        lines.append(f"… {len(c.standing) - _MOST} more in standing.csv")
    if c.unlike or c.common:
        lines.append("")
    lines += [
        f"{u.key} {u.label}: {_SHORT[u.parameter]} {100 * u.off:+.1f} % ± {100 * u.sd:.1f}, {len(u.motors)} motors"
        for u in c.unlike
    ]
    lines += [
        f"{x.key} {x.label}: {_SHORT[x.parameter]} of {x.motors} motors changes together, "
        f"{100 * (max(x.change) - min(x.change)):.1f} %"
        for x in c.common
    ]
    notes = left_out(c)
    if all(x is None for x in table["type"].to_pylist()):
        notes.append("no motors.csv names types: all motors count as one")
    if notes:
        lines += ["", *notes]
    names = ("motor", "window", "verdict", "why")
    some = [r for r in zip(*(table[n].to_pylist() for n in names), strict=True) if r[2] in _LOST]
    lines += ["", *(f"{m}, {x}: {v.replace('_', ' ')}: {why}" for m, x, v, why in some[:_MOST_LOST])] if some else []
    if len(some) > _MOST_LOST:
        lines.append(f"… {len(some) - _MOST_LOST} more on the page")
    return "\n".join(map(_shown, [*lines, "", f"page: {result.page}"]))
