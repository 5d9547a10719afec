"""DuckDB reads the logs and brings each window's rows together; dqwatch takes them as Arrow, without a copy."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Iterator
from typing import Any

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .sources import Source
from .work import BESIDE

Error, TooLarge = duckdb.Error, duckdb.OutOfMemoryException
_BATCH_ROWS = 65536
# Of what papers say, a log may say it itself.
SAID = ("type", "pole_pairs", "gear", "batch", "axis", "site", "firmware")


def connection(memory: str, threads: int, folder: str | os.PathLike[str]) -> duckdb.DuckDBPyConnection:
    """DuckDB with a bound on its memory; what is larger goes to `folder`. memory: "4GB"."""
    spill = os.path.join(os.fspath(folder), ".spill")
    return duckdb.connect(
        config={"memory_limit": memory, "threads": threads, "temp_directory": spill, "preserve_insertion_order": False}
    )


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _literal(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def alike(sources: Iterable[Source]) -> tuple[list[list[Source]], list[tuple[Source, Exception]]]:
    """Files whose columns are the same, together: one that has texts for numbers would make texts of all. Beside them
    those whose footer cannot be read, and why."""
    groups: dict[str, list[Source]] = {}
    shut: list[tuple[Source, Exception]] = []
    for s in sources:
        try:
            s.path.encode()
            schema = pq.read_schema(s.path)
        except (OSError, pa.ArrowException) as error:
            shut.append((s, error))
        except UnicodeError:
            shut.append((s, OSError("its name is not UTF-8")))
        else:
            groups.setdefault("\n".join(f"{f.name}\t{f.type}" for f in schema), []).append(s)
    return list(groups.values()), shut


def _query(con: duckdb.DuckDBPyConnection, sources: list[Source]) -> str:
    files = "[" + ", ".join(_literal(s.path) for s in sources) + "]"
    read = f"read_parquet({files}, hive_partitioning=false, filename='__file')"
    columns = [row[0] for row in con.sql(f"describe select * from {read}").fetchall()]
    keys = [c for c in ("motor", "window") if c in columns]
    order = ["__file", *keys, *(["t_s"] if "t_s" in columns else [])]
    text = [f"cast({_quoted(c)} as varchar) as {_quoted(c)}" for c in columns if c in BESIDE]
    rest = [_quoted(c) for c in columns if c not in BESIDE]
    return f"select {', '.join(text + rest)} from {read} order by {', '.join(map(_quoted, order))}"


def _edges(batch: pa.RecordBatch, keys: list[str]) -> list[int]:
    """Where a key changes, from 0 to the batch's rows."""
    change = np.zeros(batch.num_rows, dtype=bool)
    for key in keys:
        codes = batch.column(key).dictionary_encode().indices.to_numpy(zero_copy_only=False)
        change[1:] |= codes[1:] != codes[:-1]
    return [0, *np.flatnonzero(change).tolist(), batch.num_rows]


def _key(batch: pa.RecordBatch, keys: list[str], row: int) -> tuple[Any, ...]:
    return tuple(batch.column(key)[row].as_py() for key in keys)


def windows(con: duckdb.DuckDBPyConnection, sources: list[Source]) -> Iterator[tuple[Source, dict[str, str], pa.Table]]:
    """Each window of Parquet files of the same columns: its source, what its rows say of themselves, its rows in the
    order of time.

    One window at a time is held beside what DuckDB holds. Errors: duckdb.Error where a file cannot be read.
    """
    by_path = {s.path: s for s in sources}
    reader = con.sql(_query(con, sources)).to_arrow_reader(_BATCH_ROWS)
    keys = ["__file", *(n for n in ("motor", "window") if n in reader.schema.names)]
    held: list[pa.RecordBatch] = []
    last: tuple[Any, ...] | None = None

    def whole() -> tuple[Source, dict[str, str], pa.Table]:
        table = pa.Table.from_batches(held)
        said = {
            n: v
            for n in ("motor", "window", *SAID)
            if n in table.column_names and (v := table[n][0].as_py()) is not None
        }
        return by_path[table["__file"][0].as_py()], said, table.drop_columns(["__file"])

    for batch in reader:
        if batch.num_rows == 0:
            continue
        edges = _edges(batch, keys)
        for a, b in itertools.pairwise(edges):
            key = _key(batch, keys, a)
            if held and key != last:
                yield whole()
                held = []
            last = key
            held.append(batch.slice(a, b - a))
    if held:
        yield whole()
