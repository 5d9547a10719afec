"""A bar of tqdm for what takes over a second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeAlias

#: Called with the job's name and its fraction, 0 to 1; what it raises ends the job.
Told: TypeAlias = "Callable[[str, float], object]"

_SILENT_S = 1.0


def _notebook() -> bool:
    return "ipykernel" in sys.modules


@contextmanager
def shown(progress: bool | Told | None) -> Iterator[Told | None]:
    """``None``: a bar of tqdm where somebody watches; True, False: always, never; else what is to be called."""
    if callable(progress):
        yield progress
        return
    if progress is False or (
        progress is None and not ((sys.stderr is not None and sys.stderr.isatty()) or _notebook())
    ):
        yield None
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        yield None
        return
    begun = time.monotonic()
    bar: Any = None

    def told(job: str, fraction: float) -> None:
        nonlocal bar
        if time.monotonic() - begun < _SILENT_S:
            return
        if bar is None:
            bar = tqdm(total=100.0, leave=False, bar_format="{desc} {percentage:3.0f} %|{bar}| {elapsed}")
        bar.set_description(job, refresh=False)
        bar.n = min(max(100.0 * fraction, 0.0), 100.0)
        bar.refresh()

    try:
        yield told
    finally:
        if bar is not None:
            bar.close()
