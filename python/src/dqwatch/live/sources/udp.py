"""UDP: a datagram is a line or several, of CSV or JSON."""

from __future__ import annotations

import contextlib
import socket
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from ..decode import Decoder, Row

MOST_DATAGRAMS = 4096
BUFFER_BYTES = 4 << 20
#: Of Linux: each datagram tells how many were dropped before it.
_RXQ_OVFL, _RCVBUFFORCE = 40, 33


class UdpPort:
    """Datagrams that come to ``host``:``port``."""

    def __init__(self, host: str, port: int, decoder: Decoder) -> None:
        self._decoder = decoder
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        # Beyond net.core.rmem_max where one may.
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.SOL_SOCKET, _RCVBUFFORCE, BUFFER_BYTES)
        self._socket.setblocking(False)
        self.dropped = 0
        if sys.platform == "linux":
            self._socket.setsockopt(socket.SOL_SOCKET, _RXQ_OVFL, 1)
        try:
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise
        self.address = self._socket.getsockname()

    def poll(self) -> Iterable[tuple[str, Row]]:
        """The rows of the datagrams that are there."""
        for _ in range(MOST_DATAGRAMS):
            try:
                data, more, _, _ = self._socket.recvmsg(65536, 64)
            except BlockingIOError:
                return
            for level, kind, value in more:
                if level == socket.SOL_SOCKET and kind == _RXQ_OVFL:
                    self.dropped = int.from_bytes(value, sys.byteorder)
            for line in data.split(b"\n"):
                if line.strip():
                    yield from self._decoder.message(line)

    def close(self) -> None:
        """Give the socket back."""
        self._socket.close()


def opener(host: str, port: int, decoder: Decoder) -> Any:
    """What a Source opens."""

    def connect(_: Mapping[str, Any]) -> UdpPort:
        return UdpPort(host, port, decoder)

    return connect
