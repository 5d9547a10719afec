"""One window of one motor: what dqwatch says of its rows, as one row of results. The same under every engine."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from .glance import glance, machine_beside
from .windows import PARAMETERS

_TEXTS = ("motor", "window", "verdict", "regime", "why", "source", "source_hash", "settings", "given")
_NUMBERS = (
    "day",
    "pole_pairs",
    "temp_winding_C",
    "v_dc_V",
    "i_rms_A",
    "w_rms_rad_s",
    "residual_d_percent",
    "residual_q_percent",
)
SCHEMA = pa.schema(
    [pa.field(n, pa.string()) for n in _TEXTS]
    + [pa.field("faults", pa.list_(pa.string()))]
    + [pa.field(n, pa.int64()) for n in ("rows", "rows_used", "source_size", "source_mtime_ns")]
    + [pa.field(n, pa.float64()) for n in _NUMBERS]
    + [
        f
        for p in PARAMETERS
        for f in (pa.field(p, pa.float64()), pa.field(f"{p}_sd", pa.float64()), pa.field(f"{p}_usable", pa.bool_()))
    ]
)
# What a log may hold beside its channels, and is no channel.
BESIDE = frozenset(
    (
        "motor",
        "window",
        "week",
        "day",
        "date",
        "type",
        "batch",
        "axis",
        "site",
        "firmware",
        "pole_pairs",
        "gear",
        "filename",
        "source",
    )
)
_POLLED_S = 0.004  # from row to row: what is slower are means of a poll


@dataclasses.dataclass(frozen=True)
class Settings:
    """What results depend on beside logs and papers. regime: "" where the rows decide."""

    regime: str = ""

    def digest(self) -> str:
        """Text that differs where results may."""
        import dqwatch

        return f"{dqwatch.__version__}/{self.regime or 'auto'}"


def given_of(papers: Mapping[str, str], path: str) -> str:
    """What papers and the machine file beside a log say to its fit, as text that differs where results may."""
    said = "/".join(papers.get(key, "") for key in ("pole_pairs", "gear"))
    if beside := machine_beside(path):
        try:
            with open(beside, "rb") as file:
                said += "/" + hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=8)).hexdigest()
        except OSError:
            said += "/closed"
    return said


def _regime(table: pa.Table, settings: Settings) -> str:
    if settings.regime:
        return settings.regime
    names = table.column_names
    if "t_s" not in names or "v_q_V" not in names or table.num_rows < 3:
        return ""
    t = table["t_s"].to_numpy()
    return "polled" if float(np.median(np.diff(t))) >= _POLLED_S else ""


def channels(table: pa.Table) -> pa.Table:
    """Its columns of numbers that have any, in the order of time."""
    keep = []
    for k, f in enumerate(table.schema):
        number = pa.types.is_floating(f.type) or pa.types.is_integer(f.type) or pa.types.is_decimal(f.type)
        if f.name in BESIDE or not number or table[f.name].null_count == table.num_rows > 0:
            continue
        if pa.types.is_decimal(f.type):
            table = table.set_column(k, f.name, table[f.name].cast(pa.float64()))
        keep.append(f.name)
    table = table.select(keep)
    if "t_s" in keep and table.num_rows > 1:
        t = table["t_s"].to_numpy()
        if np.any(t[1:] < t[:-1]):
            table = table.take(np.argsort(t, kind="stable"))
    return table


def _mean(x: Any) -> float:
    """Of the rows that have a value; NaN where none has."""
    known = x[np.isfinite(x)]
    return float(np.mean(known)) if known.size else float("nan")


def _means(table: pa.Table) -> dict[str, float]:
    out: dict[str, float] = {}

    def column(name: str) -> Any:
        return table[name].to_numpy() if name in table.column_names else None

    for name in ("temp_winding_C", "v_dc_V"):
        if (x := column(name)) is not None and x.size:
            out[name] = _mean(x)
    i_q, i_d, w = column("i_q_A"), column("i_d_A"), column("w_m_rad_s")
    if i_q is not None and i_q.size:
        out["i_rms_A"] = float(np.sqrt(_mean(i_q**2 + (i_d**2 if i_d is not None else 0))))
    if w is not None and w.size:
        out["w_rms_rad_s"] = float(np.sqrt(_mean(w**2)))
    return out


def _number(x: str | None) -> float | None:
    return float(x) if x else None


def empty_row(**known: Any) -> dict[str, Any]:
    """A row of nothing but what is known."""
    return dict.fromkeys(SCHEMA.names) | {"faults": []} | known


def tables_of(machine: str) -> dict[str, dict[str, Any]]:
    """What a machine file says, to be said together with a regime that it leaves open; nothing, as if it had said that
    one, where it is not told so: by a mistake in it, or by a path that is told from its folder."""
    try:
        with open(machine, "rb") as file:
            said = tomllib.load(file)
    except (OSError, ValueError):
        return {}
    numbers = all(isinstance(table, dict) for table in said.values()) and set(said) <= {"machine", "log", "columns"}
    if not numbers or any(isinstance(x, str) for x in said.get("machine", {}).values()):
        return {}
    return {"log": {}} | said


def _fit(log: Any, papers: Mapping[str, str], regime: str, machine: str) -> dict[str, Any]:
    import dqwatch

    options: dict[str, Any] = {"machine": machine} if machine else {}
    said = tables_of(machine) if machine else {}
    if poles := _number(papers.get("pole_pairs")):
        options["pole_pairs"] = int(poles)
    if gear := _number(papers.get("gear")):
        options["gear"] = gear
    if regime:
        options["machine"] = said | {"log": said.get("log", {}) | {"regime": regime}}
    found: dict[str, Any] = json.loads(dqwatch.fit(log, progress=False, **options).to_json())
    if found["regime"] == "mechanical":
        # What a bearing drags with is not viscous alone.
        found = json.loads(dqwatch.fit(log, progress=False, effects=["coulomb_friction"], **options).to_json())
    return found


def _faults(log: Any, pole_pairs: float | None, machine: str) -> list[str]:
    """What the monitor says of rows of single periods; an event it names, once."""
    import dqwatch

    poles = int(pole_pairs) if pole_pairs else None
    events = dqwatch.monitor(log, progress=False, pole_pairs=poles, machine=machine or None).events
    return sorted({str(e.fault) for e in events})


def _fill(row: dict[str, Any], found: Mapping[str, Any]) -> None:
    row["rows"], row["regime"] = found.get("rows"), found.get("regime")
    for axis in found.get("residual", {}).get("axes", []):
        if (name := f"residual_{axis['axis']}_percent") in row:
            row[name] = axis["percent"]
    values = dict(found["parameters"])
    for effect in found.get("effects", []):
        if effect["name"] == "dead_time" and "voltage_V" in effect["parameters"]:
            values["dead_time_V"] = effect["parameters"]["voltage_V"]
        if effect["name"] == "coulomb_friction" and "torque_Nm" in effect["parameters"]:
            values["coulomb_Nm"] = effect["parameters"]["torque_Nm"]
    for p in PARAMETERS:
        if p in values and not values[p].get("given"):
            row[p], row[f"{p}_sd"] = float(values[p]["value"]), float(values[p]["sd"])
            row[f"{p}_usable"] = bool(values[p].get("usable", 3 * values[p]["sd"] < 0.1 * abs(values[p]["value"])))
    if "pole_pairs" in values and values["pole_pairs"]["value"] is not None:
        row["pole_pairs"] = float(values["pole_pairs"]["value"])
    usable = [p for p in PARAMETERS if row[f"{p}_usable"]]
    row["verdict"] = "good" if usable else "weak" if any(row[p] is not None for p in PARAMETERS) else "nothing"
    why = [f"{p}: {values[p]['why']}" for p in PARAMETERS if p in values and values[p].get("why")]
    why += [f"{n['name']}: {n['why']}" for n in found.get("not_identifiable", [])]
    row["why"] = "; ".join(why)
    row["rows_used"] = row["rows"]
    for note in found.get("notes", []):
        if note.startswith("polled: ") and " of " in note:
            row["rows_used"] = int(note.split()[1])


def window_row(
    log: pa.Table | str, settings: Settings, papers: Mapping[str, str], machine: str = "", **known: Any
) -> dict[str, Any]:
    """The row of one window. `log`: its channels (see channels()), or the path of a file that dqwatch reads itself.
    `machine`: of a table, path of the machine file beside its log, "" where there is none.

    Never raises for what a log holds: the row then says why not.
    """
    import dqwatch

    row = empty_row(settings=settings.digest(), **known)
    seen = log if isinstance(log, pa.Table) else glance(log)
    machine = machine_beside(log) if isinstance(log, str) else machine
    try:
        regime = settings.regime
        if seen is not None and (not machine or "regime" not in tables_of(machine).get("log", {"regime": ""})):
            with np.errstate(invalid="ignore"):
                regime = _regime(seen, settings)
        _fill(row, _fit(log, papers, regime, machine))
        if row["regime"] == "dynamic":
            try:
                row["faults"] = _faults(log, _number(papers.get("pole_pairs")) or row["pole_pairs"], machine)
            except dqwatch.Error as error:  # the fit stands
                row["why"] = "; ".join(filter(None, (row["why"], f"not monitored: {error}")))
    except Exception as error:  # of any kind: one log stops nothing
        row["verdict"], row["why"] = "not_fitted", str(error).strip() or type(error).__name__
    if seen is not None:
        with np.errstate(over="ignore"):
            row |= _means(seen)
        row["rows"] = seen.num_rows
    return row


def rows_table(rows: list[dict[str, Any]]) -> pa.Table:
    """Rows as a table of the schema."""
    return pa.Table.from_pylist(rows, schema=SCHEMA)
