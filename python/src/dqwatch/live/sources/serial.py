"""A serial port: text of SimpleFOC, CSV, JSON lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import serial

from ..decode import Decoder, Row
from . import MOST_BYTES, Lost


class SerialPort:
    """``decoder`` reads what comes in at ``baud``."""

    def __init__(self, path: str, baud: int, decoder: Decoder) -> None:
        self._decoder = decoder
        try:
            self._port = serial.Serial(path, baud, timeout=0, exclusive=True)
        except (serial.SerialException, ValueError) as error:
            raise Lost(f"{path}: {error}") from None

    def poll(self) -> Iterable[tuple[str, Row]]:
        """The rows of what has come in."""
        try:
            data = self._port.read(MOST_BYTES)
        except (serial.SerialException, TypeError) as error:
            raise Lost(str(error)) from None
        return self._decoder.feed(data) if data else ()

    def close(self) -> None:
        """Give the port back."""
        try:
            self._port.close()
        except OSError:
            pass


def opener(path: str, baud: int, decoder: Decoder) -> Any:
    """What a Source opens."""

    def connect(_: Mapping[str, Any]) -> SerialPort:
        return SerialPort(path, baud, decoder)

    return connect
