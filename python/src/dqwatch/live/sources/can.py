"""A CAN bus by python-can; a DBC says, by cantools, what its frames hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import can
from cantools.database import load_file
from cantools.database.can import Database
from cantools.database.errors import Error as DatabaseError

from ..decode import Decoder, Row, row_of
from . import Lost

MOST_FRAMES = 4096


class CanPort:
    """One motor's signals. A row is made when ``last`` of its messages has come; what did not come anew is held."""

    def __init__(self, bus: Mapping[str, Any], dbc: str, last: str, decoder: Decoder) -> None:
        try:
            database = load_file(dbc, strict=False)
            if not isinstance(database, Database):
                raise Lost(f"{dbc}: no CAN database")
            self._database = database
            self._last = self._database.get_message_by_name(last).frame_id
            self._bus = can.Bus(**bus)
        except (can.CanError, OSError, KeyError, ValueError, DatabaseError) as error:
            raise Lost(f"{type(error).__name__}: {error}") from None
        self._decoder = decoder
        self._known = {m.frame_id for m in self._database.messages}
        self._held: dict[str, float] = {}

    def poll(self) -> Iterable[tuple[str, Row]]:
        """The rows of the frames that are there."""
        for _ in range(MOST_FRAMES):
            try:
                frame = self._bus.recv(0.0)
            except can.CanError as error:
                raise Lost(str(error)) from None
            if frame is None:
                return
            if frame.is_error_frame or frame.is_remote_frame or frame.arbitration_id not in self._known:
                continue
            row = self._row(frame)
            if row:
                yield self._decoder.motor, row

    def _row(self, frame: can.Message) -> Row | None:
        counts = self._decoder.counts
        try:
            values = self._database.decode_message(frame.arbitration_id, bytes(frame.data), decode_choices=False)
        except Exception as error:  # of a hostile frame cantools raises many kinds
            counts.broken += 1
            counts.note(f"frame {frame.arbitration_id:x}: {error}")
            return None
        assert isinstance(values, dict)
        self._held.update({k: float(v) for k, v in values.items() if isinstance(v, int | float)})
        if frame.arbitration_id != self._last:
            return None
        row = row_of(self._held, self._decoder.plan)
        if row is None:
            counts.broken += 1
        return row

    def close(self) -> None:
        """Give the bus back."""
        self._bus.shutdown()


def opener(bus: Mapping[str, Any], dbc: str, last: str, decoder: Decoder) -> Any:
    """What a Source opens."""

    def connect(_: Mapping[str, Any]) -> CanPort:
        return CanPort(bus, dbc, last, decoder)

    return connect
