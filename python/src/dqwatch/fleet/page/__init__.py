"""fleet.html: one page that opens offline; names of motors are data in it, never script."""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from ..compare import LIMIT, Comparison, left_out
from ..naming import SAYS
from ..windows import D_AXIS, GROUPS, UNITS, Windows

_KINDS = {"f4": "<f4", "f8": "<f8", "i4": "<i4"}


def _blob(arrays: dict[str, tuple[str, npt.NDArray[Any]]]) -> dict[str, Any]:
    """Arrays, eights of bytes apart, deflated."""
    at: dict[str, list[Any]] = {}
    pieces: list[bytes] = []
    size = 0
    for name, (kind, x) in arrays.items():
        raw = np.ascontiguousarray(x, dtype=_KINDS[kind]).tobytes()
        at[name] = [kind, size, int(x.size)]
        raw += b"\0" * (-len(raw) % 8)
        pieces.append(raw)
        size += len(raw)
    return {"at": at, "bytes": base64.b64encode(zlib.compress(b"".join(pieces), 6)).decode()}


def _finite(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def _headline(w: Windows, c: Comparison, windows: int) -> str:
    motors, batches = len(c.standing), len({(u.key, u.label) for u in c.unlike})
    together = len({(x.key, x.label) for x in c.common})
    text = f"{motors} of {len(w.motors)} motors stand{'s' if motors == 1 else ''} out"
    if not motors:
        text = f"None of {len(w.motors)} motors stands out"
    if c.alone == len(w.motors):
        text = f"None of {len(w.motors)} motors is compared"
    if batches:
        text += f", {batches} group{'s are' if batches > 1 else ' is'} unlike the others"
    if together:
        text += f", {together} group{'s' if together > 1 else ''} changed together"
    return text + "."


def page(w: Windows, c: Comparison, table: pa.Table) -> str:
    """The page of a comparison. `table`: the windows, with verdicts and reasons."""
    index = {name: k for k, name in enumerate(w.motors)}
    summary: dict[str, tuple[str, npt.NDArray[Any]]] = {}
    windows: dict[str, tuple[str, npt.NDArray[Any]]] = {"day": ("f8", w.day)}
    of = []
    for k, o in enumerate(c.of):
        z = o.z + o.shift / np.sqrt(o.off_sd**2 + o.spread**2)
        summary |= {
            f"m{k}": ("i4", o.motors),
            f"z{k}": ("f4", z),
            f"o{k}": ("f4", o.off + o.shift),
            f"t{k}": ("f4", o.slope),
            f"sz{k}": ("f4", o.slope_z),
            f"d{k}": ("f8", o.day),
        }
        motor = w.motor[o.window]
        order = np.lexsort((w.day[o.window], motor))
        begin = np.searchsorted(motor[order], np.append(o.motors, len(w.motors)))
        sd = o.scale * w.sd[o.parameter][o.window]
        sd = sd / (w.value[o.parameter][o.window] if o.parameter == D_AXIS else o.size)
        windows |= {
            f"w{k}": ("i4", o.window[order]),
            f"y{k}": ("f4", o.y[order]),
            f"s{k}": ("f4", sd[order]),
            f"b{k}": ("i4", begin),
        }
        per_K = o.slopes.get("per_K")
        of.append(
            {
                "type": o.type,
                "parameter": o.parameter,
                "unit": UNITS[o.parameter],
                "value": o.value,
                "size": _finite(o.size),
                "sd": o.sd,
                "spread": o.spread,
                "drift": o.drift,
                "motors": int(o.motors.size),
                "per_K": per_K.value if per_K else None,
                "per_K_sd": per_K.sd if per_K else None,
            }
        )
    verdicts, whys = table["verdict"].to_pylist(), table["why"].to_pylist()
    names, labels = table["motor"].to_pylist(), table["window"].to_pylist()
    lost = [
        {"index": index[m], "window": x, "verdict": v, "why": y or ""}
        for m, x, v, y in zip(names, labels, verdicts, whys, strict=False)
        if v in ("not_read", "not_fitted", "nothing")
    ]
    faults = [
        {"index": index[m], "window": x, "why": ", ".join(f).replace("_", " ")}
        for m, x, f in zip(names, labels, table["faults"].to_pylist(), strict=False)
        if f
    ]
    days = w.day[np.isfinite(w.day)]
    first, last = (float(days.min()), float(days.max())) if days.size else (0.0, 0.0)
    data = {
        "title": "Fleet",
        "headline": _headline(w, c, len(names)),
        "about": f"{len(names)} windows; {len(lost)} not usable; {c.tests} tests, false discoveries held at 1 %."
        + "".join(f" {line}." for line in left_out(c)),
        "motors": w.motors,
        "causes": SAYS,
        "limit": LIMIT,
        "last": last,
        "weeks": (last - first) / 7,
        "windows_of": np.bincount(w.motor, minlength=len(w.motors)).tolist(),
        "groups": {g: {"labels": w.labels[g], "of": w.group[g].tolist()} for g in GROUPS if w.labels[g]},
        "of": of,
        "standing": [
            {
                "motor": s.motor,
                "index": index[s.motor],
                "type": s.type,
                "cause": s.cause,
                "says": s.says,
                "also": s.also,
                "like": s.like,
                "signs": [
                    {"parameter": x.parameter, "what": x.what, "off": x.off, "sd": x.sd, "z": x.z, "q": x.q}
                    for x in s.signs
                ],
                "crossing": [s.crossing[0], *(_finite(x) for x in s.crossing[1:])] if s.crossing else None,
            }
            for s in c.standing
        ],
        "unlike": [
            {
                "key": u.key,
                "label": u.label,
                "type": u.type,
                "parameter": u.parameter,
                "off": u.off,
                "sd": u.sd,
                "z": u.z,
                "motors": [index[m] for m in u.motors],
            }
            for u in c.unlike
        ],
        "common": [
            {
                "key": x.key,
                "label": x.label,
                "parameter": x.parameter,
                "weeks": x.weeks,
                "change": x.change,
                "sd": x.sd,
                "motors": x.motors,
            }
            for x in c.common
        ],
        "lost": lost,
        "faults": faults,
        "summary": _blob(summary),
        "windows": _blob(windows),
    }
    here = resources.files(__package__)
    script = here.joinpath("fleet.js").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    # A data block ends at "</script", whatever is in it: no "<" stays one.
    island = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for character in "<>&":
        island = island.replace(character, f"\\u{ord(character):04x}")
    text = here.joinpath("fleet.html").read_text(encoding="utf-8")
    text = text.replace("@SCRIPT_HASH@", f"sha256-{digest}")
    text = text.replace("@STYLE@", here.joinpath("fleet.css").read_text(encoding="utf-8"))
    before, _, after = text.partition("@DATA@")
    return before + island + after.replace("@SCRIPT@", script)
