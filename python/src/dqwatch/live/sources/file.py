"""A file that grows: read on from where the last run stopped; one that was replaced or cut from its beginning."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from ..decode import Decoder, Row
from . import MOST_BYTES


class GrowingFile:
    """Lines of ``path`` from ``position`` on: ``inode``, ``offset`` behind the last whole line, ``header``."""

    def __init__(self, path: str, decoder: Decoder, position: Mapping[str, Any]) -> None:
        self._path = path
        self._decoder = decoder
        self._file = open(path, "rb")
        self._inode = os.fstat(self._file.fileno()).st_ino
        self._header = b""
        self._offset = 0
        if position.get("inode") == self._inode and position.get("offset", 0) <= self._size():
            self._offset = int(position["offset"])
            self._header = str(position.get("header", "")).encode()
            for _ in decoder.message(self._header) if self._header else ():
                pass
        self._file.seek(self._offset)
        self._rest = b""

    def _size(self) -> int:
        return os.fstat(self._file.fileno()).st_size

    def poll(self) -> Iterable[tuple[str, Row]]:
        """The rows that were written since."""
        if self._offset + len(self._rest) > self._size() or os.stat(self._path).st_ino != self._inode:
            self._inode, self._offset = -1, 0
            raise OSError(f"{self._path}: replaced or cut; read from its beginning")
        data = self._rest + self._file.read(MOST_BYTES)
        end = data.rfind(b"\n") + 1
        self._rest = data[end:]
        if not end:
            if len(self._rest) > MOST_BYTES:
                self._offset += len(self._rest)
                self._rest = b""
                self._decoder.counts.too_long += 1
            return []
        if self._offset == 0:
            self._header = data[: data.find(b"\n")][:4096]
        self._offset += end
        return list(self._decoder.feed(data[:end]))

    def where(self) -> dict[str, Any]:
        """Behind the last whole line."""
        header = self._header.decode("utf-8", "replace")
        return {"inode": self._inode, "offset": self._offset, "header": header}

    def close(self) -> None:
        """Give the file back."""
        self._file.close()


def opener(path: str, decoder: Decoder) -> Any:
    """What a Source opens."""

    def connect(position: Mapping[str, Any]) -> GrowingFile:
        return GrowingFile(path, decoder, position)

    return connect
