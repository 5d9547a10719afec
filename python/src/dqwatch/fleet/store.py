"""Results in a folder: parts that appear whole or not at all, and claims that keep two runs off each other's work."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .sources import Source
from .work import SCHEMA

_STALE_S = 3600.0  # of a claim that another machine holds: it is taken for dead


class Store:
    """The folder that a run writes: windows/*.parquet, and claims/ while runs are under way."""

    def __init__(self, out: str | os.PathLike[str]) -> None:
        self.folder = Path(out)
        self.windows = self.folder / "windows"
        self.claims = self.folder / "claims"
        self.windows.mkdir(parents=True, exist_ok=True)
        self.claims.mkdir(exist_ok=True)

    @staticmethod
    def part_name(sources: list[Source], settings: str) -> str:
        """Of the same files and settings always the same."""
        words = [settings, *(f"{s.name}\t{s.size}\t{s.mtime_ns}" for s in sorted(sources))]
        return hashlib.blake2b("\n".join(words).encode(), digest_size=12).hexdigest()

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

    def table(self, settings: str | None = None) -> pa.Table:
        """All rows, one a motor and window: where a log was replaced or is there twice, the youngest file's."""
        tables = [pq.read_table(p, schema=SCHEMA) for p in self.parts()]
        table = pa.concat_tables(tables) if tables else SCHEMA.empty_table()
        if settings is not None:
            import pyarrow.compute as pc

            table = table.filter(pc.equal(table["settings"], settings))
        table = table.sort_by(
            [
                ("motor", "ascending"),
                ("window", "ascending"),
                ("regime", "ascending"),
                ("source_mtime_ns", "descending"),
                ("source", "ascending"),
            ]
        )
        seen: set[tuple[str, str, bool]] = set()
        keep = []
        mechanical = [r == "mechanical" for r in table["regime"].to_pylist()]
        for k, key in enumerate(zip(table["motor"].to_pylist(), table["window"].to_pylist(), mechanical, strict=False)):
            if key not in seen:
                seen.add(key)
                keep.append(k)
        return table.take(pa.array(keep, pa.int64()))

    def done(self, settings: str) -> set[tuple[str, int, int]]:
        """Name, size and time of every file whose rows are here."""
        out: set[tuple[str, int, int]] = set()
        for path in self.parts():
            t = pq.read_table(path, columns=["source", "source_size", "source_mtime_ns", "settings"])
            out.update(
                (n, z, m)
                for n, z, m, s in zip(*(t[c].to_pylist() for c in t.column_names), strict=False)
                if s == settings
            )
        return out
