"""Spark spreads the files over a cluster; every executor does with its own what a run on one machine does."""

from __future__ import annotations

import dataclasses
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pyarrow as pa
from pyspark.sql import SparkSession
from pyspark.sql.types import StructType

from .run import Papers, Run, parts_of, put_all
from .sources import Source
from .store import Store, depends_on
from .work import SCHEMA, Settings

_PART_FILES = 4096
# Tasks of a part: more than a cluster has cores, each worth its start.
_TASKS, _TASK_LEAST_BYTES, _TASK_MOST_BYTES = 256, 1 << 20, 64 << 20


def _schema() -> StructType:
    from pyspark.sql.pandas.types import from_arrow_schema

    return from_arrow_schema(SCHEMA)


def _of_files(
    tasks: Sequence[Sequence[Source]], settings: Settings, papers: Papers, memory: str
) -> Callable[[Iterable[pa.RecordBatch]], Iterator[pa.RecordBatch]]:
    """The function that runs on an executor: numbers of tasks in, their rows out. Spark brings no log: it would turn
    every row into one of its own and back."""

    def fitted(numbers: Iterable[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(1) as pool:
            run = Run(Path(folder), settings, papers, memory, 1)
            for batch in numbers:
                for number in batch.column(0).to_pylist():
                    yield from run.part(list(tasks[number]), pool).to_batches()

    return fitted


def session() -> SparkSession:
    """The active session, or a local one on all cores, with this Python."""
    if active := SparkSession.getActiveSession():
        return active
    os.environ.setdefault("PYSPARK_PYTHON", sys.executable)
    return (
        SparkSession.builder.master("local[*]")
        .appName("dqwatch fleet")
        .config("spark.ui.enabled", "false")
        .getOrCreate()
    )


def run(
    store: Store,
    sources: Sequence[Source],
    settings: Settings,
    papers: Papers,
    memory: str,
    told: Callable[[int, int], None] | None = None,
) -> int:
    """As run.run(), by Spark. Executors read the files by the paths that they have here; `memory` is each task's."""
    spark = session()
    new = store.new(sources, settings.digest(), papers)
    parts = [new[k : k + _PART_FILES] for k in range(0, len(new), _PART_FILES)]
    depends = depends_on(settings.digest(), papers)
    put_all(store, parts, depends, lambda part: _part(spark, part, settings, papers, memory), told)
    return len(new)


def _part(spark: SparkSession, part: Sequence[Source], settings: Settings, papers: Papers, memory: str) -> pa.Table:
    # Elsewhere another folder is the working one.
    there = [dataclasses.replace(s, path=os.path.abspath(s.path)) for s in part]
    size = sum(max(s.size, 0) for s in there)
    tasks = parts_of(there, min(_TASK_MOST_BYTES, max(size // _TASKS, _TASK_LEAST_BYTES)))
    numbers = spark.range(0, len(tasks), 1, len(tasks))
    table = numbers.mapInArrow(_of_files(tasks, settings, papers, memory), _schema()).toArrow().cast(SCHEMA)
    return table.sort_by([("source", "ascending"), ("motor", "ascending"), ("window", "ascending")])
