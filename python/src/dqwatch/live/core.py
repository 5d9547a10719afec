"""The loop without a clock of its own: sources, motors, state, sinks. Whoever calls it says what time it is."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Protocol

from .board import Board
from .capture import Block
from .motor import LiveEvent, Motor
from .sources import Source

SAVE_S = 10.0
#: States that one turn writes, beside those of motors with an event.
MOST_SAVED = 4
#: Tiles that one turn makes: a turn stays short however many motors there are.
MOST_TILES = 4
TILE_S = 0.5


class Sink(Protocol):
    """Where things go. Nothing here waits; what cannot be taken is counted by the sink."""

    name: str

    def event(self, event: LiveEvent) -> None:
        """A change was named."""

    def tile(self, slug: str, tile: dict[str, Any]) -> None:
        """A motor's state, now and then."""

    def rows(self, motor: Motor, block: Block, first: int) -> None:
        """Rows that were learned; the first is the motor's ``first``-th."""

    def keep(self, slug: str) -> None:
        """A motor's state is about to outlive the program: so are its rows."""

    def step(self, now_s: float) -> None:
        """Do what is due."""

    def trouble(self) -> str:
        """What ails it; empty: nothing."""

    def close(self) -> None:
        """The end."""


class Live:
    """Motors by name. ``state``: the folder that outlives it; None: nothing does."""

    def __init__(
        self, motors: Sequence[Motor], sources: Sequence[Source], sinks: Sequence[Sink], state: Path | None
    ) -> None:
        self.motors = {m.name: m for m in motors}
        self.sources = list(sources)
        self.sinks = list(sinks)
        self.state = state
        self.board = Board()
        self.unknown_rows = 0
        self.first_unknown = ""
        self._untold: list[LiveEvent] = []
        self._unsaved: dict[str, str] = {}
        self._due_s: dict[str, float] = {}
        self._tile_s = dict.fromkeys(self.motors, float("-inf"))
        self._captured: set[str] = set()
        if len({m.slug for m in motors}) != len(motors):
            raise ValueError("two motors of one name; expected each once")

    def load(self) -> int:
        """Goes on where it was: how many motors were known. Raises ValueError, OSError."""
        if self.state is None:
            return 0
        known = 0
        for motor in self.motors.values():
            if not motor.load(self.state):
                continue
            known += 1
            # Killed between disk and sinks: they are told again, by the same id.
            self._untold += [e for e in motor.events if e.number > motor.told_count]
            for event in motor.events:
                self.board.event(asdict(event))
                if event.capture:
                    self._captured.add(event.id)
        for source in self.sources:
            owner = self.motors.get(source.motor)
            if owner is not None:
                source.position = dict(owner.position)
        return known

    def step(self, now_s: float) -> int:
        """One turn; the rows that came."""
        came = 0
        for source in self.sources:
            for name, rows in source.poll(now_s):
                count = 1 if isinstance(rows, dict) else len(rows)
                came += count
                motor = self.motors.get(name)
                if motor is None:
                    self.unknown_rows += count
                    self.first_unknown = self.first_unknown or name[:80]
                else:
                    motor.push(rows, now_s)
        told, self._untold = self._untold, []
        for motor in self.motors.values():
            told += motor.step(now_s)
            if motor.last_block is not None:
                for sink in self.sinks:
                    sink.rows(motor, motor.last_block, motor.counts.rows - len(motor.last_block["t_s"]))
        # On disk before anybody is told: a restart neither loses nor repeats it.
        self.save(now_s, {e.motor for e in told})
        for event in told:
            self.board.event(asdict(event))
            for sink in self.sinks:
                sink.event(event)
            self.motors[event.motor].told_count = event.number
        if told:
            self.save(now_s, {e.motor for e in told})
        self._tell_captures()
        due = [n for n, due_s in self._tile_s.items() if now_s >= due_s]
        self._tiles(now_s, {*due[:MOST_TILES], *(e.motor for e in told)})
        for sink in self.sinks:
            sink.step(now_s)
        return came

    def save(self, now_s: float, at_once: set[str]) -> None:
        """Keep the states of those motors, and of those that are due; where the disk takes none, that is said."""
        if self.state is None:
            return
        due = [m for m in self.motors.values() if now_s >= self._due_s.get(m.name, now_s)]
        for source in self.sources:
            owner = self.motors.get(source.motor)
            if owner is not None:
                owner.position = source.where()
        for motor in self.motors.values():
            if motor.name not in at_once and motor not in due[:MOST_SAVED]:
                continue
            self._due_s[motor.name] = now_s + SAVE_S
            for sink in self.sinks:
                sink.keep(motor.slug)
            try:
                motor.save(self.state)
                self._unsaved.pop(motor.name, None)
            except OSError as error:
                self._unsaved[motor.name] = f"the state cannot be kept: {error.strerror or error}"

    def _tell_captures(self) -> None:
        for motor in self.motors.values():
            for event in motor.events:
                if event.capture and event.id not in self._captured:
                    self._captured.add(event.id)
                    self.board.event(asdict(event))

    def _tiles(self, now_s: float, names: set[str]) -> None:
        if not names:
            return
        for name in names:
            motor = self.motors[name]
            # Behind all others: every one has its turn.
            del self._tile_s[name]
            self._tile_s[name] = now_s + TILE_S
            tile, detail = views(motor, now_s)
            self.board.tile(motor.slug, tile, detail)
            for sink in self.sinks:
                sink.tile(motor.slug, tile)
        self.board.around([asdict(replace(s.health)) for s in self.sources], self.health())

    def health(self) -> dict[str, Any]:
        """What ails the program itself."""
        found = sorted(set(self._unsaved.values())) + [t for t in (s.trouble() for s in self.sinks) if t]
        return {"trouble": found, "unknown_rows": self.unknown_rows, "first_unknown": self.first_unknown}

    def close(self, now_s: float) -> None:
        """Keep everything, and end."""
        for motor in self.motors.values():
            motor.finish()
        self.save(now_s, set(self.motors))
        self._tell_captures()
        self._tiles(now_s, set(self.motors))
        for sink in self.sinks:
            with contextlib.suppress(OSError):
                sink.close()
        for source in self.sources:
            source.close()


def views(motor: Motor, now_s: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """A motor's tile, and what its page shows."""
    status = motor.monitor.status()
    parameters = status["parameters"]
    watched = sorted(n for n, p in parameters.items() if p.get("watched"))
    why = {n: p.get("why") for n, p in parameters.items() if not p.get("watched") and p.get("why")}
    last = motor.events[-1] if motor.events else None
    if motor.stalled(now_s):
        look = "stalled"
    elif last is not None:
        look = "fault"
    elif watched:
        look = "healthy"
    else:
        look = "learning"
    tile = {
        "slug": motor.slug,
        "name": motor.name,
        "look": look,
        "stage": status.get("stage"),
        "watched": len(watched),
        "channels": len(parameters),
        "why": next(iter(why.values()), "") if not watched else "",
        "fault": last.fault if last else "",
        "phase": last.phase if last else "",
        "confidence": last.confidence if last else None,
        "events": motor.event_count,
        "silent_s": None if motor.last_row_at is None else round(now_s - motor.last_row_at),
    }
    shown = {
        n: {k: p.get(k) for k in ("value", "sd", "healthy", "band", "least_change", "watched", "why")}
        for n, p in parameters.items()
    }
    detail = {
        **tile,
        "t_s": motor.t_s if status["rows"] else None,
        "rows": motor.counts.rows,
        "counts": asdict(motor.counts),
        "refused": status.get("refused", {}),
        "residual_pu": status.get("residual_pu"),
        "parameters": shown,
        "history": motor.history,
        "notes": list(motor.notes),
    }
    return tile, detail
