"""One motor: its rows into a monitor, what came of it, what outlives a restart."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

import dqwatch

from . import state
from .advice import advice
from .capture import Block, Capture, Minute
from .decode import COLUMNS, NEEDED, Row, Rows, rows_of

#: A stamp that goes back by more is a clock that was set, or a controller that began anew.
SET_BACK_S = 1.0
MOST_EVENTS = 200
MOST_POINTS = 600
#: Rows that wait for a step; more of them come faster than they are learned.
MOST_WAITING = 200_000
MOST_CAPTURES = 20


@dataclass
class LiveEvent:
    """A change that was named, as every sink tells it. ``id`` never comes twice."""

    id: str
    number: int
    motor: str
    t_s: float
    since_s: float
    at_unix_s: float
    fault: str
    phase: str
    parameter: str
    value: float | None
    sd: float | None
    healthy: float | None
    confidence: float
    advice: str
    capture: str = ""  # the log's name, once it is written


@dataclass
class Counts:
    """Rows of a motor."""

    rows: int = 0
    late: int = 0  # not after the row before
    dropped: int = 0  # more than could wait
    clock_set: int = 0
    gaps: int = 0
    captures_left: int = 0  # no disk, or too many at once


@dataclass
class Settings:
    """Of one motor. ``machine``: what dqwatch.Monitor takes. ``replayed``: stamps never begin anew."""

    name: str
    machine: Mapping[str, Any]
    arithmetic: Literal["float", "q15"] = "float"
    stall_s: float = 5.0
    replayed: bool = False
    folder: Path | None = None
    extra: dict[str, Any] = field(default_factory=dict)


def _plain(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


class Motor:
    """Rows wait in it until :meth:`step` has the monitor learn them."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.name = settings.name
        self.slug = state.slug(settings.name)
        self.counts = Counts()
        self.events: deque[LiveEvent] = deque(maxlen=MOST_EVENTS)
        self.event_count = 0
        self.told_count = 0  # events that every sink has been given
        self.position: dict[str, Any] = {}
        self.notes: deque[str] = deque(maxlen=20)
        self.history: list[dict[str, Any]] = []
        self.last_row_at: float | None = None
        self.last_block: Block | None = None
        self.t_s = -math.inf
        self._offset_s = 0.0
        self._every_s, self._next_s = 1.0, -math.inf
        self._waiting: list[Row | Rows] = []
        self._waiting_rows = 0
        self._minute = Minute()
        self._captures: list[tuple[LiveEvent, Capture]] = []
        self.period_s = float(settings.machine["period_s"])
        self.monitor = dqwatch.Monitor(dict(settings.machine), arithmetic=settings.arithmetic, **settings.extra)
        self._has_angle = bool(settings.extra.get("angle", settings.machine.get("angle", True)))

    # ---- rows

    def push(self, rows: Row | Rows, now_s: float) -> None:
        """One row, or some; they wait for :meth:`step`. Without a stamp each comes a period after the last."""
        self.last_row_at = now_s
        count = 1 if isinstance(rows, dict) else len(rows)
        left = MOST_WAITING - self._waiting_rows
        if count > left:
            self.counts.dropped += count - left
            if left == 0 or isinstance(rows, dict):
                return
            rows, count = rows[:left], left
        self._waiting.append(rows)
        self._waiting_rows += count

    def step(self, now_s: float) -> list[LiveEvent]:
        """Learns what waits; the events that it told."""
        parts, self._waiting, self._waiting_rows = self._waiting, [], 0
        block = self.last_block = self._block(rows_of(parts)) if parts else None
        if block is None:
            return []
        told = [self._event(e, now_s) for e in self.monitor.block(**block)]
        self.counts.rows += len(block["t_s"])
        self._minute.add(block)
        self._keep(told, block)
        if self.t_s >= self._next_s:
            self._remember()
        return told

    def _block(self, rows: Rows) -> Block | None:
        """Rows that follow each other, as arrays by column."""
        stamps, rows = self._stamps(rows)
        if len(stamps) == 0:
            return None
        # Before the first row nothing is missing.
        steps = np.diff(stamps, prepend=self.t_s if self.t_s > -math.inf else stamps[0])
        self.counts.gaps += int(np.count_nonzero(steps > 1.5 * self.period_s))
        self.t_s = float(stamps[-1])
        wanted = [c in NEEDED or (c == "theta_e_rad" and self._has_angle) for c in COLUMNS]
        said = [not np.isnan(column).all() for column in rows.T]
        return {"t_s": stamps} | {
            column: rows[:, k].copy()
            for k, column in enumerate(COLUMNS)
            if wanted[k] or (column.startswith("temp_") and said[k])
        }

    def _stamps(self, rows: Rows) -> tuple[npt.NDArray[np.float64], Rows]:
        """When each row was, and the rows without those that were there before."""
        stamps = rows[:, 0] + self._offset_s
        # Nearly always.
        if stamps[0] > self.t_s and (stamps[1:] > stamps[:-1]).all():
            return stamps, rows
        last_s, kept = self.t_s, []
        for k, given in enumerate(rows[:, 0].tolist()):
            stamp = self._stamp(given, last_s)
            if stamp is not None:
                last_s = stamps[k] = stamp
                kept.append(k)
        return stamps[kept], rows[kept]

    def _stamp(self, given: float, last_s: float) -> float | None:
        """Time goes on whatever the row's clock does; None: the row was there before."""
        if math.isnan(given):
            return self.period_s if last_s == -math.inf else last_s + self.period_s
        stamp = given + self._offset_s
        if stamp > last_s:
            return stamp
        if self.settings.replayed or last_s - stamp <= SET_BACK_S:
            self.counts.late += 1
            return None
        self.counts.clock_set += 1
        self.note(f"the clock went back by {last_s - stamp:.3g} s: rows go on behind it")
        # Two periods: a gap, for nobody knows how long it was.
        stamp = last_s + 2.0 * self.period_s
        self._offset_s = stamp - given
        return stamp

    # ---- what came of it

    def _event(self, e: dqwatch.Event, now_s: float) -> LiveEvent:
        self.event_count += 1
        made = LiveEvent(
            id=f"{self.slug}-{self.event_count}",
            number=self.event_count,
            motor=self.name,
            t_s=e.t_s,
            since_s=e.since_s,
            at_unix_s=now_s,
            fault=e.fault,
            phase=e.phase,
            parameter=e.parameter,
            value=_plain(e.value),
            sd=_plain(e.sd),
            healthy=_plain(e.healthy),
            confidence=e.confidence,
            advice=advice(e.fault),
        )
        self.events.append(made)
        return made

    def _keep(self, told: list[LiveEvent], block: Block) -> None:
        """The minutes around events, on disk when they are whole."""
        waiting, self._captures = self._captures, []
        for event, capture in waiting:
            if not capture.add(block):
                self._captures.append((event, capture))
            else:
                self._write(event, capture)
        for event in told:
            folder = self.settings.folder
            if folder is None:
                continue
            if len(self._captures) >= MOST_CAPTURES:
                self.counts.captures_left += 1
                continue
            path = folder / f"{event.id}.csv"
            self._captures.append((event, Capture(path, self._minute, event.t_s, self.settings.machine)))

    def _write(self, event: LiveEvent, capture: Capture) -> None:
        try:
            capture.write()
        except OSError as error:
            self.counts.captures_left += 1
            self.note(f"the minutes around {event.id} could not be kept: {error.strerror or error}")
        else:
            event.capture = capture.path.name

    def finish(self) -> None:
        """What is not whole yet is kept as it is."""
        waiting, self._captures = self._captures, []
        for event, capture in waiting:
            self._write(event, capture)

    def _remember(self) -> None:
        """A point of each parameter for the page; when there are too many every second one goes."""
        point: dict[str, Any] = {"t_s": self.t_s}
        for name, p in self.monitor.status()["parameters"].items():
            if p.get("value") is not None:
                point[name] = [p["value"], p.get("sd"), p.get("healthy"), p.get("band")]
        self.history.append(point)
        if len(self.history) > MOST_POINTS:
            self.history = self.history[::2]
            self._every_s *= 2.0
        self._next_s = self.t_s + self._every_s

    def note(self, text: str) -> None:
        """Something that people should know of it."""
        if text not in self.notes:
            self.notes.append(text)

    def stalled(self, now_s: float) -> bool:
        """No row for longer than it may be."""
        return self.last_row_at is None or now_s - self.last_row_at > self.settings.stall_s

    # ---- across restarts

    def save(self, folder: Path) -> None:
        """Raises OSError."""
        head = {
            "motor": self.name,
            "counts": asdict(self.counts),
            "event_count": self.event_count,
            "told_count": self.told_count,
            "events": [asdict(e) for e in self.events],
            "position": self.position,
            "t_s": self.t_s if self.t_s > -math.inf else None,
            "offset_s": self._offset_s,
            "history": self.history,
            "every_s": self._every_s,
        }
        state.write(folder / f"{self.slug}.state", head, self.monitor.state())

    def load(self, folder: Path) -> bool:
        """Goes on where it was saved; False where it never was. Raises ValueError, OSError."""
        kept = state.read(folder / f"{self.slug}.state")
        if kept is None:
            return False
        head, monitor = kept
        if head["motor"] != self.name:
            raise ValueError(f"{folder / self.slug}.state: of motor {head['motor']!r}; remove it to begin anew")
        found = dqwatch.Monitor.from_state(monitor)
        if found.settings() != self.monitor.settings() or found.arithmetic != self.monitor.arithmetic:
            raise ValueError(
                f"{folder / self.slug}.state: of another configuration of {self.name!r}; expected the same machine, "
                "or the file removed to begin anew"
            )
        self.monitor = found
        self.counts = Counts(**head["counts"])
        self.event_count = head["event_count"]
        self.told_count = head["told_count"]
        self.events.extend(LiveEvent(**e) for e in head["events"])
        self.position = head["position"]
        self.t_s = -math.inf if head["t_s"] is None else head["t_s"]
        self._offset_s = head["offset_s"]
        self.history = head["history"]
        self._every_s = head["every_s"]
        return True
