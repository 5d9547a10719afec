"""Simulated joints at 2 kHz: rows of a healthy one, and of one whose magnets lost flux."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import dqwatch

PERIOD_S = 5e-4
MACHINE: dict[str, Any] = {
    "v_V": 14.0,
    "i_A": 6.0,
    "w_m_rad_s": 130.0,
    "pole_pairs": 4,
    "period_s": PERIOD_S,
    "R_ohm": 0.5,
    "Ld_H": 1e-3,
    "Lq_H": 1.4e-3,
    "psi_Wb": 0.02,
}


def simulate(folder: Path, duration_s: float, **nonideal: object) -> Path:
    """A log, and its file."""
    dead = {"dead_time_V": 0.24, "dead_time_width_A": 0.05}
    log = dqwatch.simulate(
        scenario="joint_24v", duration_s=duration_s, drive={"dt_s": PERIOD_S}, nonideal={**dead, **nonideal}
    )
    path = folder / "joint.csv"
    np.savetxt(
        path, np.column_stack(list(log.columns.values())), fmt="%.9g", delimiter=",", header=",".join(log.columns),
        comments="",
    )  # fmt: skip
    return path


def rows_of(path: Path) -> list[dict[str, float]]:
    names, *lines = path.read_text().splitlines()
    wanted = ("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad")
    kept = [(k, n) for k, n in enumerate(names.split(",")) if n in wanted]
    return [{n: float(parts[k]) for k, n in kept} for parts in (line.split(",") for line in lines)]
