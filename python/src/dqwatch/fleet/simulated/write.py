"""A simulated fleet as files: a folder a motor, a Parquet file a week, and motors.csv."""

from __future__ import annotations

import csv
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .planted import TYPES, Fleet

_COASTING_PART = 0.06  # of the motors that have no worn bearing: they are measured too


def coasting(fleet: Fleet) -> list[int]:
    """Motors whose shaft is logged as it coasts: those of worn bearings, and others by chance."""
    rng = fleet.random(2)
    chance = rng.random(len(fleet.members))
    least = np.sort(chance)[min(len(chance) - 1, 59)]
    return [
        k
        for k, m in enumerate(fleet.members)
        if m.planted == "worn_bearing" or (not m.planted and chance[k] <= max(_COASTING_PART, least))
    ]


def coast_log(fleet: Fleet, number: int, week: int) -> dict[str, np.ndarray]:
    """Ten seconds of torque steps and coasting at 1 kHz, from the simulator."""
    import dqwatch

    member = fleet.members[number]
    m, _wrong = member.week(week, fleet.weeks)
    like = TYPES[member.said]
    w = like.speed_rad_s
    i_A = like.J_kgm2 * 2 * w / 0.5 / (1.5 * m.pole_pairs * like.psi_Wb)
    settings = {
        "machine.pole_pairs": m.pole_pairs,
        "machine.R_ohm": m.R_ohm,
        "machine.Ld_H": m.Ld_H,
        "machine.Lq_H": m.Lq_H,
        "machine.psi_Wb": m.psi_Wb,
        "machine.J_kgm2": m.J_kgm2,
        "machine.B_Nms_rad": m.B_Nms_rad,
        "machine.coulomb_Nm": m.coulomb_Nm,
        "machine.coulomb_width_rad_s": 0.01 * w,
        "profile.speed_start_rad_s": -w,
        "profile.i_q_A.wave": i_A,
        "profile.i_q_A.random": i_A,
    }
    found = dqwatch.simulate(
        scenario="coast_friction",
        seed=int(fleet.random(3, number, week).integers(1, 2**31)),
        settings=settings,
        progress=False,
    )
    return {name: found[name] for name in ("t_s", "w_m_rad_s", "torque_Nm")}


def _write(folder: Path, name: str, columns: dict[str, np.ndarray]) -> None:
    pq.write_table(pa.table(columns), folder / name, compression="zstd")


def _motor(job: tuple[Fleet, int, str, bool]) -> None:
    fleet, number, out, coasts = job
    folder = Path(out) / "logs" / f"motor={fleet.members[number].name}"
    folder.mkdir(parents=True, exist_ok=True)
    for week in range(fleet.weeks):
        day = fleet.day(week).isoformat()
        _write(folder, f"{day}.parquet", fleet.log(number, week))
        if coasts and week == fleet.weeks - 1:
            _write(folder, f"{day}-coast.parquet", coast_log(fleet, number, week))


def write(fleet: Fleet, out: str | os.PathLike[str], processes: int | None = None) -> Path:
    """Writes logs and papers into a folder; returns that of the logs. The truth is planted.csv beside it."""
    root = Path(out)
    (root / "logs").mkdir(parents=True, exist_ok=True)
    with open(root / "logs" / "motors.csv", "w", newline="") as file:
        papers = csv.writer(file)
        papers.writerow(("motor", "type", "pole_pairs", "batch", "axis", "site", "firmware"))
        for m in fleet.members:
            papers.writerow((m.name, m.said, TYPES[m.said].pole_pairs, m.batch, m.axis, m.site, m.firmware))
    with open(root / "planted.csv", "w", newline="") as file:
        truth = csv.writer(file)
        truth.writerow(("motor", "planted", "size"))
        truth.writerows((m.name, m.planted, m.size) for m in fleet.members if m.planted)
    coasts = set(coasting(fleet))
    jobs = [(fleet, k, os.fspath(root), k in coasts) for k in range(len(fleet.members))]
    with ProcessPoolExecutor(processes) as pool:
        for _ in pool.map(_motor, jobs, chunksize=4):
            pass
    return root / "logs"


def wrongly_named(fleet: Fleet, causes: dict[str, str]) -> dict[str, tuple[str, str]]:
    """Motors whose cause is not what was planted: name, (planted, said); "" for nothing."""
    out = {}
    for m in fleet.members:
        said = causes.get(m.name, "")
        if said != m.planted:
            out[m.name] = (m.planted, said)
    return out


__all__ = ["coast_log", "coasting", "write", "wrongly_named"]
