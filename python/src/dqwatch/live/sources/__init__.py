"""Where rows come from. A source gives what is there, waits for nothing, and says what ails it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from ..decode import Decoder, Row, Rows

#: Bytes or messages that one poll takes at most, so that no source starves the others.
MOST_BYTES = 1 << 20
RETRY_S = 1.0


class Lost(Exception):
    """The source is not there now; its text says why."""


@dataclass
class Health:
    """What the page says of a source."""

    name: str
    kind: str
    connected: bool = False
    trouble: str = ""
    connects: int = 0
    losses: int = 0
    dropped: int = 0
    broken: int = 0
    first_broken: str = ""


class Port(Protocol):
    """An open connection."""

    def poll(self) -> Iterable[tuple[str, Row | Rows]]:
        """The rows that are there, one or some at a time. Raises Lost, OSError."""

    def close(self) -> None:
        """Give it back."""


@dataclass
class Source:
    """One source: opened when it is there, and again when it was lost."""

    name: str
    kind: str
    open: Callable[[Mapping[str, Any]], Port]
    decoders: list[Decoder]
    position: dict[str, Any] = field(default_factory=dict)
    motor: str = ""

    def __post_init__(self) -> None:
        self.health = Health(self.name, self.kind)
        self._port: Port | None = None
        self._retry_s = float("-inf")

    def poll(self, now_s: float) -> list[tuple[str, Row | Rows]]:
        """The rows that are there now; none while it is lost."""
        if self._port is None and now_s < self._retry_s:
            return []
        rows: list[tuple[str, Row | Rows]] = []
        try:
            if self._port is None:
                self._port = self.open(self.position)
                self.health.connected, self.health.trouble = True, ""
                self.health.connects += 1
            rows.extend(self._port.poll())
        except (Lost, OSError) as error:
            self._lose(str(error) or type(error).__name__, now_s)
        self._count()
        return rows

    def _lose(self, why: str, now_s: float) -> None:
        self.health.trouble = why
        self._retry_s = now_s + RETRY_S
        if self.health.connected:
            self.health.losses += 1
        self.health.connected = False
        self.where()
        port, self._port = self._port, None
        if port is not None:
            port.close()
        for decoder in self.decoders:
            decoder.reset()

    def _count(self) -> None:
        counts = [d.counts for d in self.decoders]
        self.health.broken = sum(c.broken + c.too_long for c in counts)
        self.health.first_broken = next((c.first for c in counts if c.first), "")
        self.health.dropped = int(getattr(self._port, "dropped", self.health.dropped) or 0)

    def where(self) -> dict[str, Any]:
        """The position up to which rows were given: where a restart goes on."""
        where = getattr(self._port, "where", None)
        if where is not None:
            self.position = where()
        return self.position

    def close(self) -> None:
        """Give the connection back."""
        if self._port is not None:
            self._port.close()
            self._port = None
