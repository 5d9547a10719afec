"""Running motors: rows from serial ports, CAN, UDP, MQTT or files into monitors; a page, MQTT, Prometheus, Parquet."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str]) -> int:
    """``dqwatch live``; ``argv`` without the word. Returns the exit code."""
    from .cli import run

    return run(argv)
