"""UDP: a datagram is a line or several, of CSV or JSON. A thread of the compiled part empties the kernel's buffer."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from collections.abc import Iterable, Mapping
from typing import Any

from dqwatch import _core

from ..decode import Decoder, Row, Rows

#: What the kernel may hold where it lets us, and what waits for the loop.
KERNEL_BYTES, WAITING_BYTES = 16 << 20, 64 << 20
#: Of Linux: each datagram tells how many were dropped before it.
_RXQ_OVFL, _RCVBUFFORCE = 40, 33


class UdpPort:
    """Datagrams that come to ``host``:``port``."""

    def __init__(self, host: str, port: int, decoder: Decoder) -> None:
        self._decoder = decoder
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BYTES)
        # Beyond net.core.rmem_max where one may.
        with contextlib.suppress(OSError):
            self._socket.setsockopt(socket.SOL_SOCKET, _RCVBUFFORCE, KERNEL_BYTES)
        if sys.platform == "linux":
            self._socket.setsockopt(socket.SOL_SOCKET, _RXQ_OVFL, 1)
        try:
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise
        self.address = self._socket.getsockname()
        self.dropped = 0
        self._datagrams = _core.Datagrams(self._socket.fileno(), WAITING_BYTES)

    def poll(self) -> Iterable[tuple[str, Row | Rows]]:
        """The rows of the datagrams that have come."""
        data, self.dropped, error = self._datagrams.take()
        if error:
            raise OSError(error, os.strerror(error))
        return self._decoder.lines(data)

    def close(self) -> None:
        """Give the socket back."""
        self._datagrams.close()
        self._socket.close()


def opener(host: str, port: int, decoder: Decoder) -> Any:
    """What a Source opens."""

    def connect(_: Mapping[str, Any]) -> UdpPort:
        return UdpPort(host, port, decoder)

    return connect
