"""fleet(logs, out): fits every window, compares the motors, writes results and the page."""

from __future__ import annotations

import csv
import dataclasses
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .compare import LIMIT, Comparison, compare
from .page import page
from .robust import crossing
from .run import bytes_of, cores, run
from .sources import PAPERS, papers_of, sources
from .store import Store, stale_by
from .windows import D_AXIS, Windows, windows_of
from .work import Settings

_NUMBERS = ("off", "off_sd", "z", "drift_week", "drift_week_sd", "drift_z", "crosses_day", "from_day", "to_day")
_COMPARED = pa.schema(
    [pa.field(n, pa.string()) for n in ("motor", "type", "parameter")] + [pa.field(n, pa.float64()) for n in _NUMBERS]
)
Paths = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


@dataclasses.dataclass(frozen=True)
class FleetResult:
    """What a run gives: every window, the comparison, and where the page is. `new`: files read in this run."""

    windows: pa.Table
    comparison: Comparison
    page: Path
    new: int

    def __repr__(self) -> str:
        return f"<FleetResult: {self.windows.num_rows} windows, {len(self.comparison.standing)} motors stand out>"


def with_papers(table: pa.Table, papers: dict[str, dict[str, str]]) -> pa.Table:
    """The windows with what is known of each motor; numbers stay as the windows have them."""
    names = table["motor"].to_pylist()
    for key in PAPERS:
        if key not in ("pole_pairs", "gear"):
            said = [papers.get(name, {}).get(key) for name in names]
            table = table.append_column(key, pa.array(said, pa.string()))
    return table


def _cell(x: object) -> object:
    """A text that a spreadsheet would take for a formula is told to be a text."""
    return f"'{x}" if isinstance(x, str) and x[:1] in ("=", "+", "-", "@", "\t", "\r") else x


def compared_table(w: Windows, c: Comparison) -> pa.Table:
    """A row a motor and parameter that is compared: how far it is off as a part of the type's value (`d_axis`: as a
    logarithm), its drift a week, both with deviations, and the day on which that crosses the limit, with its 95 %."""
    columns: dict[str, list[object]] = {name: [] for name in _COMPARED.names}
    for o in c.of:
        for j, m in enumerate(o.motors):
            level, drift = float(o.off[j] + o.shift[j]), float(o.slope[j])
            at = low = high = math.nan
            if o.parameter != D_AXIS and np.isfinite(drift):
                limit = math.copysign(LIMIT, drift)
                found = crossing(float(o.off[j]), float(o.off_sd[j]), drift, float(o.slope_sd[j]), limit)
                at, low, high = (float(o.day[j]) + x for x in found)
            row = (w.motors[m], o.type, o.parameter, level, o.off_sd[j], o.z[j], 7 * drift, 7 * o.slope_sd[j])
            for name, x in zip(columns, (*row, o.slope_z[j], at, low, high), strict=True):
                columns[name].append(x if isinstance(x, str) else _finite(float(x)))
    return pa.table(columns, schema=_COMPARED)


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None


def write_tables(w: Windows, c: Comparison, folder: Path) -> None:
    """compared.parquet, standing.csv and groups.csv: what the page shows, for other programs. Whole or not at all."""
    own = folder / f".compared.{os.getpid()}.part"
    pq.write_table(compared_table(w, c), own, compression="zstd")
    os.replace(own, folder / "compared.parquet")

    def write(name: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
        own = folder / f".{name}.{os.getpid()}.part"
        with open(own, "w", newline="", encoding="utf-8") as file:
            out = csv.writer(file)
            out.writerow(head)
            out.writerows([_cell(x) for x in row] for row in rows)
        os.replace(own, folder / name)

    write(
        "standing.csv",
        (
            "motor",
            "type",
            "cause",
            "also",
            "like",
            "parameter",
            "what",
            "off",
            "sd",
            "z",
            "q",
            "crosses_day",
            "from_day",
            "to_day",
        ),
        [
            (
                s.motor,
                s.type,
                s.cause,
                " ".join(s.also),
                s.like,
                x.parameter,
                x.what,
                x.off,
                x.sd,
                x.z,
                x.q,
                *(
                    (s.crossing[1:])
                    if s.crossing and s.crossing[0] == x.parameter and x.what == "drift"
                    else ("", "", "")
                ),
            )
            for s in c.standing
            for x in s.signs
        ],
    )
    write(
        "groups.csv",
        ("what", "key", "label", "type", "parameter", "off", "sd", "motors", "chance"),
        [("unlike", u.key, u.label, u.type, u.parameter, u.off, u.sd, len(u.motors), u.q) for u in c.unlike]
        + [
            ("together", x.key, x.label, "", x.parameter, max(x.change) - min(x.change), max(x.sd), x.motors, x.p)
            for x in c.common
        ],
    )


def fleet(
    logs: Paths,
    out: str | os.PathLike[str],
    *,
    motors: str | os.PathLike[str] | None = None,
    regime: str = "",
    engine: Literal["duckdb", "spark"] = "duckdb",
    memory: str = "4GB",
    threads: int | None = None,
    told: Callable[[int, int], None] | None = None,
) -> FleetResult:
    """Compares the motors of a fleet with each other.

    Parameters
    ----------
    logs
        a folder, a glob, a path, or several: Parquet, or any format that dqwatch reads. A log's motor is its column
        ``motor``, its folder ``motor=…`` or the folder that it lies in; its window the column ``window``, a folder
        ``week=…``, ``day=…``, or the file's name, with a date in it (2026-01-05)
    out
        folder for windows/*.parquet (one row a motor and window), fleet.html, compared.parquet, standing.csv,
        groups.csv. A second run reads files that are new or have changed, or whose papers have; runs at once share the
        work
    motors
        table (CSV or Parquet) of what papers say: motor, type, pole_pairs, gear, batch, axis, site, firmware; default:
        motors.csv or motors.parquet beside the logs
    regime
        of all logs, where their rows do not tell: polled, dynamic, steady, standstill, mechanical
    engine
        "duckdb" on this machine; "spark" on the session that is active, or a local one
    memory
        bound on DuckDB's and the windows' memory, "4GB"; with Spark of each task
    threads
        default: all cores
    told
        called with (files done, new files)

    Errors: FileNotFoundError without logs, ValueError for settings or a table that cannot be. What is wrong with one
    log stands in its row (verdict, why).
    """
    settings = Settings(regime)
    papers = papers_of(logs, motors)
    found = sources(logs)
    bytes_of(memory)
    if threads is not None and threads < 1:
        raise ValueError(f"--threads {threads}: expected a number from 1 on")
    store = Store(out)
    if engine == "spark":
        from . import spark

        new = spark.run(store, found, settings, papers, memory, told)
    elif engine == "duckdb":
        new = run(store, found, settings, papers, memory, threads or cores(), told)
    else:
        raise ValueError(f"engine {engine!r}: expected 'duckdb' or 'spark'")
    table = with_papers(store.table(settings.digest(), stale_by(found, papers)), papers)
    w = windows_of(table)
    c = compare(w)
    path = store.folder / "fleet.html"
    own = store.folder / f".fleet.html.{os.getpid()}.part"
    own.write_text(page(w, c, table), encoding="utf-8")
    os.replace(own, path)
    write_tables(w, c, store.folder)
    return FleetResult(table, c, path, new)
