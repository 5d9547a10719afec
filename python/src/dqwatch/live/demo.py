"""Two simulated motors: one stays healthy, the other's magnets lose flux after a minute."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from .core import Live
from .decode import COLUMNS, Row
from .motor import Motor, Settings
from .setup import ConfigError
from .sources import Source

FAILS_S = 60.0
PERIOD_S = 5e-4
_PLATE = {"v_V": 14.0, "i_A": 6.0, "w_m_rad_s": 130.0, "pole_pairs": 4, "period_s": PERIOD_S}
_MACHINE = {**_PLATE, "R_ohm": 0.5, "Ld_H": 1e-3, "Lq_H": 1.4e-3, "psi_Wb": 0.02}
_SPAN_S = 20.0


def _simulate(folder: Path, name: str, sets: Mapping[str, float]) -> Path:
    """A log of the simulator."""
    binary = os.environ.get("DQWATCH") or shutil.which("dqwatch")
    if binary is None:
        raise ConfigError("the simulator is of the compiled dqwatch, which is not on PATH; `make install` puts it there")
    command = [binary, "sim", "joint_24v", "--out", str(folder / name), "--set", f"duration_s={_SPAN_S}"]
    for key, value in {"drive.dt_s": PERIOD_S, **sets}.items():
        command += ["--set", f"{key}={value}"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return folder / name / "joint_24v.csv"


class Replay:
    """A log at the speed at which it was simulated, over and over, and from ``FAILS_S`` on another one."""

    def __init__(self, motor: str, first: Path, then: Path, clock: Any = time.monotonic) -> None:
        self._motor = motor
        self._clock = clock
        self._began_s: float | None = None
        self._rows = _endless(first, then)
        self._next = next(self._rows)

    def poll(self) -> Iterable[tuple[str, Row]]:
        """The rows that are due."""
        now_s = self._clock()
        if self._began_s is None:
            self._began_s = now_s
        while self._next["t_s"] <= now_s - self._began_s:
            yield self._motor, self._next
            self._next = next(self._rows)

    def close(self) -> None:
        """Nothing is open."""


def _endless(first: Path, then: Path) -> Iterator[Row]:
    begun_s = 0.0
    while True:
        rows = _rows(then if begun_s >= FAILS_S else first)
        for row in rows:
            yield {**row, "t_s": row["t_s"] + begun_s}
        begun_s += _SPAN_S


@lru_cache
def _rows(path: Path) -> list[Row]:
    with open(path) as file:
        names = file.readline().strip().split(",")
        kept = [k for k, n in enumerate(names) if n in COLUMNS and not n.startswith("temp_")]
        return [{names[k]: float(parts[k]) for k in kept} for parts in (line.split(",") for line in file)]


def demo(folder: Path) -> tuple[Live, Path]:
    """The two of them."""
    print("simulating two motors …", flush=True)
    dead = {"nonideal.dead_time_V": 0.24, "nonideal.dead_time_width_A": 0.05}
    healthy = _simulate(folder, "healthy", dead)
    worn = _simulate(folder, "worn", {**dead, "nonideal.demagnetisation": 0.06})
    events = folder / "events"
    events.mkdir()
    motors, sources = [], []
    for name, then in (("left wheel", healthy), ("right wheel", worn)):
        motors.append(Motor(Settings(name, _MACHINE, folder=events)))
        port = Replay(name, healthy, then)
        sources.append(Source(f"simulated {name}", "simulator", lambda _, port=port: port, []))  # type: ignore[misc]
    print(f"the magnets of the right wheel's motor lose flux {FAILS_S:.0f} s from now", flush=True)
    return Live(motors, sources, [], folder), events
