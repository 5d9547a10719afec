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
from .sources import PAGES, Source, day_of, unreadable
from .store import Store
from .work import Settings, channels, empty_row, rows_table, window_row

Papers = Mapping[str, Mapping[str, str]]
_PART_FILES, _PART_BYTES = 64, 64 << 20
_UNITS = {"KB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}


def bytes_of(memory: str) -> int:
    """Of "4GB", "512MiB". Errors: ValueError."""
    text = memory.strip().upper()
    for unit, size in _UNITS.items():
        if text.endswith(unit):
            try:
                return int(float(text[: -len(unit)]) * size)
            except ValueError:
                break
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


def _not_read(source: Source, settings: Settings, error: BaseException, content: str) -> dict[str, Any]:
    why = unreadable(source) if source.parquet else ""
    why = why or (PAGES if source.parquet and source.size > 0 else str(error) or type(error).__name__)
    return empty_row(**known_of(source, {}, content), settings=settings.digest(), verdict="not_read", why=why)


class Run:
    """What all parts of a run share. `folder` takes what is larger than memory."""

    def __init__(self, folder: Path, settings: Settings, papers: Papers, memory: str, threads: int) -> None:
        self.settings, self.papers, self.threads = settings, papers, threads
        self.bytes = bytes_of(memory)
        # Windows in flight and Arrow's own need the other half.
        limit = f"{max(self.bytes // 2, 100 << 20)}B"
        self.connection = duck.connection(limit, threads, folder)

    def _jobs(self, sources: list[Source], content: Mapping[Source, str]) -> Iterator[Callable[[], dict[str, Any]]]:
        def of_table(source: Source, said: dict[str, str], table: pa.Table) -> Callable[[], dict[str, Any]]:
            known = known_of(source, said, content[source])
            papers = papers_for(known["motor"], self.papers, said)
            machine = machine_beside(source.path)
            return lambda: window_row(channels(table), self.settings, papers, machine, **known)

        def of_file(source: Source) -> Callable[[], dict[str, Any]]:
            known = known_of(source, {}, content[source])
            papers = papers_for(known["motor"], self.papers, {})
            return lambda: window_row(source.path, self.settings, papers, **known)

        parquet = [s for s in sources if s.parquet]
        for s in sources:
            if not s.parquet:
                yield of_file(s)
        if not parquet:
            return
        told: list[Source] = []
        try:
            for source, said, table in duck.windows(self.connection, parquet):
                if source not in told:
                    told.append(source)
                yield of_table(source, said, table)
        except duck.Error:
            # One of them cannot be read: each alone, but those that are through.
            for s in parquet:
                if s in told[:-1]:
                    continue
                try:
                    for source, said, table in duck.windows(self.connection, [s]):
                        yield of_table(source, said, table)
                except duck.Error as error:
                    reason = error
                    yield lambda s=s, reason=reason: _not_read(s, self.settings, reason, content[s])  # type: ignore[misc]

    def part(self, sources: list[Source], pool: ThreadPoolExecutor) -> pa.Table:
        """The rows of some files."""
        content: dict[Source, str] = {}
        rows: list[dict[str, Any]] = []
        for s in sources:
            try:
                content[s] = s.content()
            except OSError as error:
                rows.append(_not_read(s, self.settings, error, ""))
        waiting: deque[Future[dict[str, Any]]] = deque()
        for job in self._jobs([s for s in sources if s in content], content):
            waiting.append(pool.submit(job))
            # Windows wait in memory: no more than keep every core busy.
            while len(waiting) > 2 * self.threads:
                rows.append(waiting.popleft().result())
        rows += [f.result() for f in waiting]
        empty = {s.name for s in content} - {r["source"] for r in rows}
        rows += [
            empty_row(**known_of(s, {}, content[s]), settings=self.settings.digest(), verdict="not_read", why="no rows")
            for s in content
            if s.name in empty
        ]
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
    digest = settings.digest()
    done = store.done(digest)
    new = [s for s in sources if (s.name, s.size, s.mtime_ns) not in done]
    r = Run(store.folder, settings, papers, memory, threads)
    parts = parts_of(new, min(_PART_BYTES, max(r.bytes // 16, 1 << 20)))
    left = [(store.part_name(p, digest), p) for p in parts]
    count = 0
    with ThreadPoolExecutor(threads, thread_name_prefix="dqwatch-fleet") as pool:
        while left:
            held = []
            for name, part in left:
                if not store.has(name):
                    with store.claimed(name) as mine:
                        if not mine:
                            held.append((name, part))
                            continue
                        if not store.has(name):
                            store.put(name, r.part(part, pool))
                count += len(part)
                if told:
                    told(count, len(new))
            if len(held) == len(left):
                time.sleep(0.2)  # another run is at work on all that is left
            left = held
    return len(new)


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))
