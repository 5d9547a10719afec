"""Hours of slow motors as fast as they can be learned: a plain machine in closed form, whose flux goes down and up.

The judge is the monitor alone, fed with the same rows in one go.
"""

from __future__ import annotations

import resource
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import dqwatch
from dqwatch.live.core import Live
from dqwatch.live.decode import Row
from dqwatch.live.motor import LiveEvent, Motor, Settings
from dqwatch.live.sources import Source

PERIOD_S = 0.01
R_OHM, LD_H, LQ_H, PSI_WB, POLE_PAIRS = 0.5, 0.05, 0.07, 0.2, 4
MACHINE: dict[str, Any] = {
    "v_V": 60.0,
    "i_A": 12.0,
    "w_m_rad_s": 40.0,
    "pole_pairs": POLE_PAIRS,
    "period_s": PERIOD_S,
    "R_ohm": R_OHM,
    "Ld_H": LD_H,
    "Lq_H": LQ_H,
    "psi_Wb": PSI_WB,
    "angle": False,
}
#: Rows after which the curves repeat, and after which the flux changes by 6 %.
SPAN, CHANGE = 100_000, 180_000

Array = npt.NDArray[np.float64]


def span_of(seed: int) -> dict[str, Array]:
    """One span: v follows from i and w, the integrals over a row by Simpson's rule."""
    x = np.arange(2 * SPAN + 1) * (np.pi / SPAN)
    d = -2 + 3 * np.sin(701 * x + seed) + np.sin(3109 * x)
    q = 4 + 3 * np.cos(1103 * x) + np.sin(4307 * x + 1 + seed)
    w = 20 + 8 * np.sin(100 * x) + 2 * np.cos(301 * x + seed)

    def mean(y: Array) -> Array:
        return (y[:-2:2] + 4 * y[1::2] + y[2::2]) / 6

    made = {
        "v_d_V": R_OHM * mean(d) + LD_H * np.diff(d[::2]) / PERIOD_S - POLE_PAIRS * LQ_H * mean(w * q),
        "v_q_V": R_OHM * mean(q) + LQ_H * np.diff(q[::2]) / PERIOD_S + POLE_PAIRS * LD_H * mean(w * d),
        "i_d_A": d[:-1:2],
        "i_q_A": q[:-1:2],
        "w_m_rad_s": w[:-1:2],
        "emf_V_per_Wb": POLE_PAIRS * mean(w),
    }
    noise = np.random.default_rng(seed)
    for name in ("v_d_V", "v_q_V"):
        made[name] = made[name] + 0.02 * noise.standard_normal(SPAN)
    return made


def blocks(seed: int, rows: int, size: int) -> Iterator[dict[str, Array]]:
    """All rows of one motor."""
    span = span_of(seed)
    for begin in range(0, rows, size):
        k = np.arange(begin, min(begin + size, rows))
        block = {c: v[k % SPAN] for c, v in span.items()}
        psi = PSI_WB * np.where((k + 37_000 * seed) // CHANGE % 2 == 0, 1.0, 0.94)
        block["v_q_V"] = block["v_q_V"] + psi * block.pop("emf_V_per_Wb")
        yield {"t_s": k * PERIOD_S, **block}


class Spans:
    """A motor's rows, so many a turn; it goes on where it is told."""

    def __init__(self, name: str, seed: int, rows: int, size: int) -> None:
        self._name, self._seed, self._rows, self._size = name, seed, rows, size
        self.at = 0
        self._blocks = blocks(seed, rows, size)

    def seek(self, at: int) -> Spans:
        while self.at < at:
            next(self._blocks)
            self.at += self._size
        return self

    def poll(self) -> list[tuple[str, Row]]:
        block = next(self._blocks, None)
        if block is None:
            return []
        self.at += self._size
        names = list(block)
        return [(self._name, dict(zip(names, r, strict=True))) for r in np.column_stack(list(block.values())).tolist()]

    def where(self) -> dict[str, int]:
        return {"at": self.at}

    def close(self) -> None:
        pass


class Ids:
    """A sink that remembers which events it was told."""

    name = "ids"

    def __init__(self) -> None:
        self.told: list[tuple[str, str, float]] = []

    def event(self, event: LiveEvent) -> None:
        self.told.append((event.id, event.motor, event.t_s))

    def tile(self, *_: Any) -> None: ...
    def rows(self, *_: Any) -> None: ...
    def keep(self, *_: Any) -> None: ...
    def step(self, now_s: float) -> None: ...
    def trouble(self) -> str:
        return ""

    def close(self) -> None: ...


def _live(names: list[str], rows: int, size: int, sink: Ids, folder: Path) -> Live:
    motors = [Motor(Settings(n, MACHINE)) for n in names]
    sources = []
    for seed, name in enumerate(names):

        def open_at(position: dict[str, int], seed: int = seed, name: str = name) -> Spans:
            return Spans(name, seed, rows, size).seek(int(position.get("at", 0)))

        sources.append(Source(name, "test", open_at, [], motor=name))
    live = Live(motors, sources, [sink], folder)
    live.load()
    return live


def peak_MiB() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def endless(hours: float, motors: int, restarts: int = 3) -> dict[str, Any]:
    """Runs them, killed and begun again ``restarts`` times; what was told against what the monitor alone tells."""
    rows, size = round(hours * 3600 / PERIOD_S), 2000
    names = [f"motor {k}" for k in range(motors)]
    sink = Ids()
    peaks: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        live = _live(names, rows, size, sink, Path(folder))
        turns, now_s, begins = rows // size, 0.0, 0
        # Turns go on where the states were.
        turn = 0
        kills = {turns * (k + 1) // (restarts + 1) for k in range(restarts)}
        while True:
            came = live.step(now_s)
            now_s += size * PERIOD_S
            turn += 1
            if turn in kills and begins < restarts:
                begins += 1
                live = _live(names, rows, size, sink, Path(folder))
                continue
            if turn % max(turns // 16, 1) == 0:
                peaks.append(peak_MiB())
            if came == 0:
                break
        learned = sum(m.counts.rows for m in live.motors.values())
    expected = []
    for seed, name in enumerate(names):
        alone = dqwatch.Monitor(MACHINE)
        expected += [(name, e.t_s) for b in blocks(seed, rows, size) for e in alone.block(**b)]
    told = [(motor, t_s) for _, motor, t_s in sink.told]
    return {
        "rows": learned,
        "events_expected": len(expected),
        "events_told": len(set(told) & set(expected)),
        "events_other": len(set(told) - set(expected)),
        "events_twice": len(told) - len(set(told)),
        "restarts": begins,
        "peaks_MiB": peaks,
    }
