"""The last minute of a motor's rows, and the minute before and after an event as a log that `trace` reads."""

from __future__ import annotations

import io
import tomllib
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .state import replace_file

Array = npt.NDArray[np.float64]
Block = dict[str, Array]

SPAN_S = 60.0
#: A minute at 20 kHz.
MOST_ROWS = 1_200_000


class Minute:
    """The last :data:`SPAN_S` of blocks, :data:`MOST_ROWS` at most."""

    def __init__(self) -> None:
        self._blocks: deque[Block] = deque()
        self._rows = 0

    def add(self, block: Block) -> None:
        """One more block; the oldest go."""
        self._blocks.append(block)
        self._rows += len(block["t_s"])
        last = float(block["t_s"][-1])
        while len(self._blocks) > 1 and (self._rows > MOST_ROWS or float(self._blocks[0]["t_s"][-1]) < last - SPAN_S):
            self._rows -= len(self._blocks.popleft()["t_s"])

    def blocks(self) -> list[Block]:
        """Oldest first."""
        return list(self._blocks)

    @property
    def rows(self) -> int:
        """How many rows it holds."""
        return self._rows


class Capture:
    """An event's two minutes: begun with the one before it, done when the one after it has passed."""

    def __init__(self, path: Path, minute: Minute, t_s: float, machine: Mapping[str, Any]) -> None:
        self.path = path
        self._blocks = minute.blocks()
        self._until_s = t_s + SPAN_S
        self._rows = minute.rows
        self._machine = machine

    def add(self, block: Block) -> bool:
        """One more block; True when nothing is missing."""
        self._blocks.append(block)
        self._rows += len(block["t_s"])
        return float(block["t_s"][-1]) >= self._until_s or self._rows > 2 * MOST_ROWS

    def write(self) -> None:
        """The log, and the machine file beside it. Raises OSError."""
        names = [c for c in self._blocks[0] if all(c in b for b in self._blocks)]
        text = io.StringIO()
        text.write(",".join(names) + "\n")
        for block in self._blocks:
            np.savetxt(text, np.column_stack([block[c] for c in names]), fmt="%.9g", delimiter=",")
        replace_file(self.path.with_suffix(".toml"), machine_text(self._machine).encode())
        # The log last: who sees it has both.
        replace_file(self.path, text.getvalue().encode())


KEYS = ("pole_pairs", "R_ohm", "Ld_H", "Lq_H", "psi_Wb", "J_kgm2", "B_Nms_rad")


def machine_text(machine: Mapping[str, Any]) -> str:
    """A machine file for the command."""
    lines = ["[log]", 'regime = "dynamic"', "[machine]"]
    lines += [f"{k} = {machine[k]!r}" for k in KEYS if isinstance(machine.get(k), int | float)]
    return "\n".join(lines) + "\n"


def read_machine(path: Path) -> dict[str, Any]:
    """What a machine file says, its tables as one, and what stands above them. Raises OSError, ValueError."""
    found = tomllib.loads(path.read_text())
    flat: dict[str, Any] = {k: v for k, v in found.items() if not isinstance(v, dict)}
    for key in ("log", "machine", "nameplate"):
        table = found.get(key, {})
        if isinstance(table, dict):
            flat.update(table)
    return {k: v for k, v in flat.items() if isinstance(v, int | float) and not isinstance(v, bool)}
