"""A run over a fleet's logs: what is new, in parts of bounded size, by as many threads as there are cores."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pyarrow as pa

from . import duck
from .glance import machine_beside
from .sources import PAGES, Source, day_of
from .store import Store, depends_on
from .work import Settings, channels, empty_row, given_of, rows_table, window_row

Papers = Mapping[str, Mapping[str, str]]
_PART_FILES, _PART_BYTES = 64, 64 << 20
_UNITS = {"KB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}


def bytes_of(memory: str) -> int:
    """Of "4GB", "512MiB". Errors: ValueError."""
    text = memory.strip().upper()
    for unit, size in _UNITS.items():
        if text.endswith(unit):
            try:
                found = int(float(text[: -len(unit)]) * size)
            except (ValueError, OverflowError):
                break
            if found > 0:
                return found
    raise ValueError(f"--memory {memory}: expected a number and a unit, such as 4GB or 512MiB")


def parts_of(sources: Sequence[Source], most_bytes: int) -> list[list[Source]]:
    """Files in parts, so that a part's bytes are bounded (one file may be more)."""
    parts: list[list[Source]] = []
    size = 0
    for s in sources:
        if not parts or len(parts[-1]) >= _PART_FILES or (size + s.size > most_bytes and parts[-1]):
            parts.append([])
            size = 0
        parts[-1].append(s)
        size += max(s.size, 0)
    return parts


def known_of(source: Source, said: Mapping[str, str], content: str) -> dict[str, Any]:
    """What a row says of where it is from."""
    window = said.get("window", source.window)
    return {
        "motor": said.get("motor", source.motor),
        "window": window,
        "day": day_of(window, source.mtime_ns),
        "source": source.name,
        "source_hash": content,
        "source_size": source.size,
        "source_mtime_ns": source.mtime_ns,
    }


def papers_for(motor: str, papers: Papers, said: Mapping[str, str]) -> dict[str, str]:
    """A log's own word counts more than the table's."""
    return {**papers.get(motor, {}), **{k: v for k, v in said.items() if k in duck.SAID}}


def _reason(error: BaseException) -> str:
    """In one line."""
    if isinstance(error, duck.TooLarge):
        return "its rows are more than --memory lets DuckDB sort, and the disk takes no more of them"
    if isinstance(error, duck.Error):
        return PAGES
    return next((line for line in str(error).splitlines() if line.strip()), type(error).__name__)


class Run:
    """What all parts of a run share. `folder` takes what is larger than memory."""

    def __init__(self, folder: Path, settings: Settings, papers: Papers, memory: str, threads: int) -> None:
        self.settings, self.papers, self.threads = settings, papers, threads
        self.bytes = bytes_of(memory)
        # Windows in flight and Arrow's own need the other half; the program with its libraries is 250 MB itself.
        limit = f"{max(min(self.bytes // 2, self.bytes - (320 << 20)), 100 << 20)}B"
        self.connection = duck.connection(limit, threads, folder)

    def _known(self, source: Source, said: Mapping[str, str], content: str) -> dict[str, Any]:
        known = known_of(source, said, content)
        return known | {"given": given_of(self.papers.get(known["motor"], {}), source.path)}

    def _not_read(self, source: Source, why: str, content: str) -> dict[str, Any]:
        known = self._known(source, {}, content)
        return empty_row(**known, settings=self.settings.digest(), verdict="not_read", why=why)

    def _jobs(self, sources: list[Source], content: Mapping[Source, str]) -> Iterator[Callable[[], dict[str, Any]]]:
        def of_table(source: Source, said: dict[str, str], table: pa.Table) -> Callable[[], dict[str, Any]]:
            known = self._known(source, said, content[source])
            papers = papers_for(known["motor"], self.papers, said)
            machine = machine_beside(source.path)
            return lambda: window_row(channels(table), self.settings, papers, machine, **known)

        def of_file(source: Source) -> Callable[[], dict[str, Any]]:
            known = self._known(source, {}, content[source])
            papers = papers_for(known["motor"], self.papers, {})
            return lambda: window_row(source.path, self.settings, papers, **known)

        def not_read(source: Source, error: Exception) -> Callable[[], dict[str, Any]]:
            why = _reason(error)
            return lambda: self._not_read(source, why, content[source])

        for s in sources:
            if not s.parquet:
                yield of_file(s)
        groups, shut = duck.alike(s for s in sources if s.parquet)
        for s, error in shut:
            yield not_read(s, error)
        for group in groups:
            told: list[Source] = []
            try:
                for source, said, table in duck.windows(self.connection, group):
                    if source not in told:
                        told.append(source)
                    yield of_table(source, said, table)
            except duck.Error:
                # One of them cannot be read: each alone, but those that are through.
                for s in group:
                    if s in told[:-1]:
                        continue
                    try:
                        for source, said, table in duck.windows(self.connection, [s]):
                            yield of_table(source, said, table)
                    except duck.Error as error:
                        yield not_read(s, error)

    def part(self, sources: list[Source], pool: ThreadPoolExecutor) -> pa.Table:
        """The rows of some files."""
        content: dict[Source, str] = {}
        rows: list[dict[str, Any]] = []
        for s in sources:
            try:
                content[s] = s.content()
            except OSError as error:
                rows.append(self._not_read(s, _reason(error), ""))
        waiting: deque[Future[dict[str, Any]]] = deque()
        for job in self._jobs([s for s in sources if s in content], content):
            waiting.append(pool.submit(job))
            # Windows wait in memory: no more than keep every core busy.
            while len(waiting) > 2 * self.threads:
                rows.append(waiting.popleft().result())
        rows += [f.result() for f in waiting]
        empty = {s.name for s in content} - {r["source"] for r in rows}
        rows += [self._not_read(s, "no rows", content[s]) for s in content if s.name in empty]
        unique = {(r["source"], r["motor"], r["window"]): r for r in rows}
        return rows_table([unique[k] for k in sorted(unique)])


def run(
    store: Store,
    sources: Sequence[Source],
    settings: Settings,
    papers: Papers,
    memory: str,
    threads: int,
    told: Callable[[int, int], None] | None = None,
) -> int:
    """Fits every window that the folder lacks; returns how many files were new. A run that is killed goes on where it
    was; runs at the same time share the parts."""
    new = store.new(sources, settings.digest(), papers)
    r = Run(store.folder, settings, papers, memory, threads)
    parts = parts_of(new, min(_PART_BYTES, max(r.bytes // 16, 1 << 20)))
    with ThreadPoolExecutor(threads, thread_name_prefix="dqwatch-fleet") as pool:
        put_all(store, parts, depends_on(settings.digest(), papers), lambda part: r.part(part, pool), told)
    return len(new)


def put_all(
    store: Store,
    parts: Sequence[list[Source]],
    depends: str,
    rows_of: Callable[[list[Source]], pa.Table],
    told: Callable[[int, int], None] | None,
) -> None:
    """Writes the rows of all parts, and waits for those that another run is at work on."""
    left = [(store.part_name(p, depends), p) for p in parts]
    count, new = 0, sum(map(len, parts))
    while left:
        held = []
        for name, part in left:
            if not store.has(name):
                with store.claimed(name) as mine:
                    if not mine:
                        held.append((name, part))
                        continue
                    if not store.has(name):
                        store.put(name, rows_of(part))
            count += len(part)
            if told:
                told(count, new)
        if len(held) == len(left):
            time.sleep(0.2)
        left = held


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))
