"""Results in a folder: parts that appear whole or not at all, and claims that keep two runs off each other's work."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from .sources import Source
from .work import SCHEMA, empty_row, given_of, rows_table

Papers = Mapping[str, Mapping[str, str]]
Key = tuple[str, int, int]
# Of a row that is a copy's, what stays.
_KNOWN = ("motor", "window", "day", "source", "source_hash", "source_size", "source_mtime_ns", "settings", "given")
_STALE_S = 3600.0  # of a claim that another machine holds: it is taken for dead


class Row(NamedTuple):
    """Of a row of results: its motor, its file's key, and what was given beside the log."""

    motor: str
    key: Key
    given: str


class Store:
    """The folder that a run writes: windows/*.parquet, and claims/ while runs are under way."""

    def __init__(self, out: str | os.PathLike[str]) -> None:
        self.folder = Path(out)
        self.windows = self.folder / "windows"
        self.claims = self.folder / "claims"
        self.windows.mkdir(parents=True, exist_ok=True)
        self.claims.mkdir(exist_ok=True)

    @staticmethod
    def part_name(sources: Sequence[Source], depends: str) -> str:
        """Of the same files, what lies beside them, and what results depend on always the same."""
        files = [[*s.key, s.opens, given_of({}, s.path)] for s in sorted(sources)]
        return hashlib.blake2b(json.dumps([depends, files]).encode(), digest_size=12).hexdigest()

    def has(self, part: str) -> bool:
        """Whether a part is written."""
        return (self.windows / f"{part}.parquet").exists()

    def put(self, part: str, table: pa.Table) -> None:
        """Writes a part; a reader sees it whole or not."""
        own = self.windows / f".{part}.{socket.gethostname()}.{os.getpid()}.part"
        with open(own, "wb") as file:
            pq.write_table(table, file, compression="zstd")
            file.flush()
            os.fsync(file.fileno())
        os.replace(own, self.windows / f"{part}.parquet")

    @contextlib.contextmanager
    def claimed(self, part: str) -> Iterator[bool]:
        """True while this run alone works on the part; False where another does."""
        path = self.claims / f"{part}.json"
        if not self._claim(path):
            yield False
            return
        try:
            yield True
        finally:
            path.unlink(missing_ok=True)

    def _claim(self, path: Path) -> bool:
        own = json.dumps({"host": socket.gethostname(), "pid": os.getpid()})
        for _ in range(2):
            try:
                handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
            except FileExistsError:
                if self._alive(path):
                    return False
                path.unlink(missing_ok=True)
                continue
            with os.fdopen(handle, "w") as file:
                file.write(own)
            return True
        return False

    @staticmethod
    def _alive(path: Path) -> bool:
        try:
            age_s = time.time() - path.stat().st_mtime
            holder: dict[str, Any] = json.loads(path.read_text() or "{}")
        except FileNotFoundError:
            return False
        except ValueError:
            return age_s < 60
        if holder.get("host") != socket.gethostname():
            return age_s < _STALE_S
        pid = holder.get("pid")
        if not isinstance(pid, int):
            return age_s < 60  # it is being written
        if pid == os.getpid():
            return True
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        except PermissionError:
            pass
        return True

    def parts(self) -> list[Path]:
        """Files of all parts, in order."""
        return sorted(p for p in self.windows.glob("*.parquet") if not p.name.startswith("."))

    def table(self, settings: str | None = None, stale: Callable[[Row], bool] = lambda row: False) -> pa.Table:
        """All rows, one a motor and window: where a log was replaced or is there twice, the youngest file's; none that
        is `stale`."""
        tables = [pq.ParquetFile(p).read() for p in self.parts()]
        table = pa.concat_tables([SCHEMA.empty_table(), *tables], promote_options="default").select(SCHEMA.names)
        if settings is not None:
            table = table.filter(pc.equal(table["settings"], settings))
        # What a coasting log tells stands beside what the same window's others do.
        coasts = pc.fill_null(pc.equal(table["regime"], "mechanical"), False)
        table = table.append_column("coasts", coasts).sort_by(
            [
                ("motor", "ascending"),
                ("window", "ascending"),
                ("coasts", "ascending"),
                ("source_mtime_ns", "descending"),
                ("source_hash", "descending"),
                ("source", "ascending"),
                ("given", "ascending"),
            ]
        )
        seen: set[tuple[str, str, bool]] = set()
        keep = []
        names = ("motor", "window", "coasts", "source", "source_size", "source_mtime_ns", "given")
        for k, row in enumerate(zip(*(table[n].to_pylist() for n in names), strict=True)):
            if row[:3] not in seen and not stale(Row(row[0], row[3:6], row[6] or "")):
                seen.add(row[:3])
                keep.append(k)
        return _without_copies(table.take(pa.array(keep, pa.int64())).drop_columns(["coasts"]))

    def done(self, settings: str) -> dict[Key, list[tuple[str, str, bool]]]:
        """By name, size and time of every file whose rows are here: motor, what was given beside it, and whether it
        could be opened."""
        out: dict[Key, list[tuple[str, str, bool]]] = {}
        for path in self.parts():
            file = pq.ParquetFile(path)
            names = ("source", "source_size", "source_mtime_ns", "settings", "motor", "given", "source_hash")
            if not set(names) <= set(file.schema_arrow.names):
                continue
            t = file.read(columns=list(names))
            for n, z, ns, said, motor, given, content in zip(*(t[c].to_pylist() for c in names), strict=True):
                if said == settings:
                    out.setdefault((n, z, ns), []).append((motor, given, bool(content)))
        return out

    def new(self, sources: Sequence[Source], settings: str, papers: Papers) -> list[Source]:
        """Files without rows here, or whose rows are of other papers, or that could not be opened and now can."""
        done = self.done(settings)

        def known(s: Source) -> bool:
            rows = done.get(s.key, [])
            of = {(motor, given) for motor, given, _opened in rows}
            shut = not any(opened for *_said, opened in rows)
            return (
                bool(rows)
                and not (shut and s.opens)
                and all((m, given_of(papers.get(m, {}), s.path)) in of for m, _g in of)
            )

        return [s for s in sources if not known(s)]


def _without_copies(table: pa.Table) -> pa.Table:
    """The same rows; of a motor's files that are alike to the byte those of one count, the first by name, and the
    others' say so: twice the same rows would halve a deviation out of nothing."""
    says = {n: table[n].to_pylist() for n in _KNOWN}
    logs = list(zip(says["motor"], says["source_hash"], says["source"], strict=True))
    first: dict[tuple[str, str], str] = {}
    for motor, content, name in sorted(logs, key=lambda x: x[2]):
        first.setdefault((motor, content or name), name)
    of = [first[motor, content or name] for motor, content, name in logs]
    copies = [k for k, (_motor, _content, name) in enumerate(logs) if of[k] != name]
    if not copies:
        return table
    rows = [
        empty_row(**{n: says[n][k] for n in _KNOWN}, verdict="nothing", why=f"a copy of {of[k]}: its rows count once")
        for k in copies
    ]
    marked = set(copies)
    kept = table.take(pa.array([k for k in range(table.num_rows) if k not in marked], pa.int64()))
    return pa.concat_tables([kept, rows_table(rows).select(table.column_names)]).sort_by(
        [("motor", "ascending"), ("window", "ascending")]
    )


def depends_on(settings: str, papers: Papers) -> str:
    """What results depend on beside the logs, as text."""
    said = [(motor, p.get("pole_pairs"), p.get("gear")) for motor, p in sorted(papers.items())]
    return hashlib.blake2b(json.dumps([settings, said]).encode(), digest_size=12).hexdigest()


def stale_by(sources: Sequence[Source], papers: Papers) -> Callable[[Row], bool]:
    """Rows of files that are here, but fitted with other papers than theirs; of a file that is gone they stay."""
    here = {s.key: s.path for s in sources}

    def stale(row: Row) -> bool:
        return row.key in here and row.given != given_of(papers.get(row.motor, {}), here[row.key])

    return stale
