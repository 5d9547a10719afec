"""Containers that other libraries read: each comes back as columns by name."""

from __future__ import annotations

from typing import Any


def takes(path: str) -> bool:
    """True where the file is one of these containers, by its first bytes."""
    return False


def read(path: str) -> Any:
    """The columns of a container."""
    raise NotImplementedError(path)
