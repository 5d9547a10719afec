"""fleet(logs, out): fits every window, compares the motors, writes results and the page."""

from __future__ import annotations

import csv
import dataclasses
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import pyarrow as pa

from .compare import Comparison, compare
from .page import page
from .run import bytes_of, cores, run
from .sources import PAPERS, papers_of, sources
from .store import Store
from .windows import windows_of
from .work import Settings

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


def write_tables(c: Comparison, folder: Path) -> None:
    """standing.csv and groups.csv: what the page shows, for other programs. Whole or not at all."""

    def write(name: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
        own = folder / f".{name}.{os.getpid()}.part"
        with open(own, "w", newline="", encoding="utf-8") as file:
            out = csv.writer(file)
            out.writerow(head)
            out.writerows(rows)
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
        folder for windows/*.parquet (one row a motor and window), fleet.html, standing.csv, groups.csv. A second run
        reads new files only; runs at once share the work
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
    store = Store(out)
    if engine == "spark":
        from . import spark

        new = spark.run(store, found, settings, papers, memory, told)
    elif engine == "duckdb":
        new = run(store, found, settings, papers, memory, threads or cores(), told)
    else:
        raise ValueError(f"engine {engine!r}: expected 'duckdb' or 'spark'")
    table = with_papers(store.table(settings.digest()), papers)
    w = windows_of(table)
    c = compare(w)
    path = store.folder / "fleet.html"
    own = store.folder / f".fleet.html.{os.getpid()}.part"
    own.write_text(page(w, c, table), encoding="utf-8")
    os.replace(own, path)
    write_tables(c, store.folder)
    return FleetResult(table, c, path, new)
