"""Shares with their intervals, scores, and Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence


def wilson(hits: int, n: int) -> tuple[float, float]:
    """95 % interval of a share."""
    if n == 0:
        return 0.0, 1.0
    z2 = 1.96**2
    middle, half = hits / n + z2 / (2 * n), 1.96 * math.sqrt(hits / n * (1 - hits / n) / n + z2 / (4 * n * n))
    return max((middle - half) / (1 + z2 / n), 0.0), min((middle + half) / (1 + z2 / n), 1.0)


def share(hits: int, n: int) -> str:
    if n == 0:
        return "–"
    low, high = wilson(hits, n)
    return f"{100 * hits / n:.1f} ({100 * low:.0f}–{100 * high:.0f})"


def interval_score(value: float, sd: float, true: float) -> float:
    """Gneiting and Raftery's of value ± 2 sd at 95 %, over the truth, at most 1: less is better."""
    return min((4 * sd + 40 * max(abs(value - true) - 2 * sd, 0)) / abs(true), 1.0)


def mean(values: Iterable[float]) -> float:
    kept = list(values)
    return sum(kept) / len(kept) if kept else math.nan


def percent(x: float) -> str:
    return f"{100 * x:.3g}"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    print("| " + " | ".join(head) + " |")
    print("| --- |" + " --: |" * (len(head) - 1))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print()
