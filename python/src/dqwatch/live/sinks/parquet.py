"""A log in Parquet: a folder motor=… each, a file a minute named by its first row: written twice it is the same."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..capture import Block, machine_text
from ..motor import LiveEvent, Motor
from ..state import replace_file

#: Rows of time in a file.
SPAN_S = 60.0
MOST_ROWS = 2_000_000


class ParquetSink:
    """Rows of every motor under ``folder``, ``most_bytes`` of each motor: the oldest files go."""

    name = "parquet"

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self._folder = folder
        self._most_bytes = most_bytes
        self._open: dict[str, tuple[int, Motor, list[Block]]] = {}
        self._begun: set[str] = set()
        self._trouble = ""
        self.lost_rows = 0

    def event(self, event: LiveEvent) -> None:
        """Events are not in it."""

    def tile(self, slug: str, tile: dict[str, Any]) -> None:
        """Nor are states."""

    def rows(self, motor: Motor, block: Block, first: int) -> None:
        """They wait until a file is full."""
        _, _, blocks = self._open.setdefault(motor.slug, (first, motor, []))
        blocks.append(block)
        rows = sum(len(b["t_s"]) for b in blocks)
        if float(block["t_s"][-1]) - float(blocks[0]["t_s"][0]) >= SPAN_S or rows > MOST_ROWS:
            self._flush(motor.slug)

    def keep(self, slug: str) -> None:
        """The file so far; it is written anew as it grows, under the same name."""
        if slug in self._open:
            self._write(*self._open[slug])

    def _flush(self, slug: str) -> None:
        self._write(*self._open.pop(slug))

    def _write(self, first: int, motor: Motor, blocks: list[Block]) -> None:
        names = [c for c in blocks[0] if all(c in b for b in blocks)]
        table = pa.table({c: np.concatenate([b[c] for b in blocks]) for c in names})
        folder = self._folder / f"motor={motor.slug}"
        path = folder / f"{first:015d}.parquet"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # Without a state before it a log that is there is another run's.
            if motor.slug not in self._begun and first > 0:
                _cut(folder, first, float(blocks[0]["t_s"][0]))
            self._begun.add(motor.slug)
            fresh = path.with_suffix(".new")
            pq.write_table(table, fresh, compression="zstd")
            os.replace(fresh, path)
            if not path.with_suffix(".toml").exists():
                replace_file(path.with_suffix(".toml"), machine_text(motor.settings.machine).encode())
            self._shrink(folder)
            self._trouble = ""
        except OSError as error:
            # Rows that wait on are tried again.
            if motor.slug not in self._open:
                self.lost_rows += table.num_rows
            self._trouble = f"the Parquet log cannot be written: {error.strerror or error}; {self.lost_rows} rows lost"

    def _shrink(self, folder: Path) -> None:
        files = sorted(folder.glob("*.parquet"))
        sizes = [f.stat().st_size for f in files]
        for file in files[:-1]:
            if sum(sizes) <= self._most_bytes:
                return
            sizes.pop(0)
            file.unlink()
            file.with_suffix(".toml").unlink(missing_ok=True)

    def step(self, now_s: float) -> None:
        """Nothing is due."""

    def trouble(self) -> str:
        """A disk that is full."""
        return self._trouble

    def close(self) -> None:
        """What waits is written as it is."""
        for slug in list(self._open):
            self._flush(slug)


def _cut(folder: Path, first: int, t_s: float) -> None:
    """A program that was killed goes on from a state that is older than its log: rows that come again, by their number
    and their time, go. Raises OSError."""
    for path in sorted(folder.glob("*.parquet"), reverse=True):
        start = int(path.stem) if path.stem.isdigit() else first
        try:
            table = pq.read_table(path)
        except (pa.ArrowInvalid, KeyError):
            continue
        if start + table.num_rows <= first or "t_s" not in table.column_names:
            return
        times = table["t_s"].to_numpy()
        again = (start + np.arange(table.num_rows) >= first) & (times >= t_s)
        if again.all():
            path.unlink()
            path.with_suffix(".toml").unlink(missing_ok=True)
        elif again.any():
            fresh = path.with_suffix(".new")
            pq.write_table(table.filter(pa.array(~again)), fresh, compression="zstd")
            os.replace(fresh, path)
