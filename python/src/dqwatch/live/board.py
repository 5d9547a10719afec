"""What is known now, for everything that shows it: made by the core, read by other threads."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

MOST_EVENTS = 1000


class Board:
    """Tiles by motor, events in order, sources. Each change has a number that grows."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._number = 0
        self._tiles: dict[str, tuple[int, dict[str, Any]]] = {}
        self._details: dict[str, dict[str, Any]] = {}
        self._events: deque[tuple[int, dict[str, Any]]] = deque(maxlen=MOST_EVENTS)
        self._sources: list[dict[str, Any]] = []
        self._health: dict[str, Any] = {}

    def tile(self, slug: str, tile: dict[str, Any], detail: dict[str, Any]) -> None:
        """A motor's tile, and what its page shows; nothing changes where it is as it was."""
        with self._changed:
            self._details[slug] = detail
            if slug in self._tiles and self._tiles[slug][1] == tile:
                return
            self._number += 1
            self._tiles[slug] = (self._number, tile)
            self._changed.notify_all()

    def event(self, event: dict[str, Any]) -> None:
        """One more event; one that is known by its id is replaced: its log was written, or traced."""
        with self._changed:
            self._number += 1
            for k, (_, known) in enumerate(self._events):
                if known["id"] == event["id"]:
                    self._events[k] = (self._number, event)
                    break
            else:
                self._events.append((self._number, event))
            self._changed.notify_all()

    def around(self, sources: list[dict[str, Any]], health: dict[str, Any]) -> None:
        """Sources, and the program itself."""
        with self._changed:
            self._sources, self._health = sources, health

    def since(self, number: int) -> tuple[int, list[dict[str, Any]], list[dict[str, Any]]]:
        """The newest number; tiles and events that are newer than ``number``."""
        with self._lock:
            tiles = [t for n, t in self._tiles.values() if n > number]
            events = [e for n, e in self._events if n > number]
            return self._number, tiles, events

    def whole(self) -> dict[str, Any]:
        """Everything but the motors' pages."""
        with self._lock:
            return {
                "number": self._number,
                "tiles": [t for _, t in self._tiles.values()],
                "events": [e for _, e in self._events],
                "sources": self._sources,
                "health": self._health,
            }

    def detail(self, slug: str) -> dict[str, Any] | None:
        """What a motor's page shows."""
        with self._lock:
            return self._details.get(slug)

    def find_event(self, event_id: str) -> dict[str, Any] | None:
        """The event of that id."""
        with self._lock:
            return next((e for _, e in self._events if e["id"] == event_id), None)
