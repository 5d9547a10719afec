"""Spark brings each window's rows together on a cluster; every executor calls dqwatch on them as Arrow."""

from __future__ import annotations

import os
import sys
import urllib.parse
from collections.abc import Callable, Sequence
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from pyspark.sql import DataFrame, SparkSession
from pyspark.sql import functions as f
from pyspark.sql.types import StructType

from .run import Papers, known_of, papers_for
from .sources import PAGES, Source, unreadable
from .store import Store
from .work import BESIDE, SCHEMA, Settings, channels, empty_row, rows_table, window_row

_FILE = "source"
_PART_FILES = 4096


def _schema() -> StructType:
    from pyspark.sql.pandas.types import from_arrow_schema

    return from_arrow_schema(SCHEMA)


def _of_group(settings: Settings, papers: Papers, by_path: dict[str, Source]) -> Callable[[pa.Table], pa.Table]:
    """The function that runs on an executor; its rows are those of every other engine, to the bit."""

    def fitted(table: pa.Table) -> pa.Table:
        said = {
            n: str(v)
            for n in ("motor", "window", *BESIDE - {_FILE, "filename"})
            if n in table.column_names and (v := table[n][0].as_py()) is not None
        }
        source = by_path[_path(table[_FILE][0].as_py())]
        content = source.content()
        known = known_of(source, said, content)
        row = window_row(channels(table), settings, papers_for(known["motor"], papers, said), **known)
        return rows_table([row])

    return fitted


def fitted(logs: DataFrame, settings: Settings, papers: Papers, by_path: dict[str, Source]) -> DataFrame:
    """One row a motor and window of `logs`, whose column `source` is each row's file."""
    keys = [_FILE, *(k for k in ("motor", "window") if k in logs.columns)]
    return logs.groupBy(*keys).applyInArrow(_of_group(settings, papers, by_path), _schema())


def _path(uri: str) -> str:
    """A local path of a URI as Spark has it (file:/…, percent signs for what is no letter); others as they are."""
    return urllib.parse.unquote(urllib.parse.urlparse(uri).path) if uri.startswith("file:") else uri


def _key(path: str) -> str:
    return path if "://" in path else os.path.abspath(path)


def session() -> SparkSession:
    """The active session, or a local one on all cores, with this Python."""
    if active := SparkSession.getActiveSession():
        return active
    os.environ.setdefault("PYSPARK_PYTHON", sys.executable)
    return (
        SparkSession.builder.master("local[*]")
        .appName("dqwatch fleet")
        .config("spark.ui.enabled", "false")
        .config("spark.sql.shuffle.partitions", "32")
        .getOrCreate()
    )


def run(
    store: Store,
    sources: Sequence[Source],
    settings: Settings,
    papers: Papers,
    told: Callable[[int, int], None] | None = None,
) -> int:
    """As run.run(), by Spark; files that are not Parquet are read by dqwatch on the driver."""
    spark = session()
    digest = settings.digest()
    done = store.done(digest)
    new = [s for s in sources if (s.name, s.size, s.mtime_ns) not in done]
    for begin in range(0, len(new), _PART_FILES):
        part = new[begin : begin + _PART_FILES]
        name = store.part_name(part, digest)
        with store.claimed(name) as mine:
            if mine and not store.has(name):
                store.put(name, _part(spark, part, settings, papers))
        if told:
            told(min(begin + _PART_FILES, len(new)), len(new))
    return len(new)


def _part(spark: SparkSession, part: Sequence[Source], settings: Settings, papers: Papers) -> pa.Table:
    def not_read(s: Source, why: str) -> dict[str, Any]:
        return empty_row(
            **known_of(s, {}, s.content() if s.size >= 0 else ""),
            settings=settings.digest(),
            verdict="not_read",
            why=why,
        )

    why = {s: unreadable(s) for s in part if s.parquet}
    parquet = [s for s in why if not why[s]]
    rows = [not_read(s, reason) for s, reason in why.items() if reason]
    rows += [
        window_row(s.path, settings, papers_for(s.motor, papers, {}), **known_of(s, {}, s.content()))
        for s in part
        if not s.parquet
    ]
    tables = []
    if parquet:
        # A file whose pages cannot be read is cut short: its rows are counted below.
        logs = (
            spark.read.option("mergeSchema", "true")
            .option("ignoreCorruptFiles", "true")
            .parquet(*(s.path for s in parquet))
            .select("*", f.col("_metadata.file_path").alias(_FILE))
        )
        found = fitted(logs, settings, papers, {_key(s.path): s for s in parquet}).toArrow().cast(SCHEMA)
        counts: dict[str, int] = {}
        for name, n in zip(found["source"].to_pylist(), found["rows"].to_pylist(), strict=False):
            counts[name] = counts.get(name, 0) + n
        short = {s.name: s for s in parquet if counts.get(s.name, 0) != pq.read_metadata(s.path).num_rows}
        tables.append(found.filter(pc.invert(pc.is_in(found["source"], pa.array(list(short), pa.string())))))
        rows += [not_read(s, PAGES) for s in short.values()]
        rows += [not_read(s, "no rows") for s in parquet if s.name not in counts and s.name not in short]
    table = pa.concat_tables([*tables, rows_table(rows)])
    return table.sort_by([("source", "ascending"), ("motor", "ascending"), ("window", "ascending")])
