"""Two simulated motors: one stays healthy, the other's magnets lose flux after a minute."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import dqwatch

from .core import Live
from .decode import COLUMNS, Row
from .motor import Motor, Settings
from .sources import Source

FAILS_S = 60.0
PERIOD_S = 5e-4
SPAN_S = 20.0
_MACHINE = {"R_ohm": 0.5, "Ld_H": 1e-3, "Lq_H": 1.4e-3, "psi_Wb": 0.02, "pole_pairs": 4}
_PLATE = {"v_V": 14.0, "i_A": 6.0, "w_m_rad_s": 130.0, "period_s": PERIOD_S}


def _simulated(lost_flux: float) -> list[Row]:
    """The rows of :data:`SPAN_S`."""
    nonideal = {"dead_time_V": 0.24, "dead_time_width_A": 0.05, "demagnetisation": lost_flux}
    log = dqwatch.simulate(
        scenario="joint_24v", duration_s=SPAN_S, drive={"dt_s": PERIOD_S}, nonideal=nonideal, progress=False
    )
    names = [c for c in COLUMNS if c in log.columns and not c.startswith("temp_")]
    return [dict(zip(names, row, strict=True)) for row in zip(*(log[c].tolist() for c in names), strict=True)]


class Replay:
    """Rows as fast as they were simulated, over and over; from :data:`FAILS_S` on others."""

    def __init__(
        self, motor: str, first: list[Row], then: list[Row], clock: Callable[[], float] = time.monotonic
    ) -> None:
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


def _endless(first: list[Row], then: list[Row]) -> Iterator[Row]:
    begun_s = 0.0
    while True:
        for row in then if begun_s >= FAILS_S else first:
            yield {**row, "t_s": row["t_s"] + begun_s}
        begun_s += SPAN_S


def demo(folder: Path, clock: Callable[[], float] = time.monotonic) -> tuple[Live, Path]:
    """The two of them; their logs around events stand in ``folder``."""
    print("simulating two motors …", flush=True)
    healthy, worn = _simulated(0.0), _simulated(0.06)
    events = folder / "events"
    events.mkdir()
    motors, sources = [], []
    for name, then in (("left wheel", healthy), ("right wheel", worn)):
        motors.append(Motor(Settings(name, {**_MACHINE, **_PLATE}, folder=events)))
        port = Replay(name, healthy, then, clock)
        sources.append(Source(f"simulated {name}", "simulator", lambda _, port=port: port, []))  # type: ignore[misc]
    print(f"the magnets of the right wheel's motor lose flux {FAILS_S:.0f} s from now", flush=True)
    return Live(motors, sources, [], None), events
