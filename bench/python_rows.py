#!/usr/bin/env python3
"""The Python package beside the command on a long log: processor time of a fit, and memory beyond the input's.

usage: python_rows.py DQWATCH FOLDER [ROWS], by a Python that has dqwatch. What is read is a simulated servo, repeated.
The times are processor seconds, so that other work on the machine changes their ratio little.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np

NAMES = ("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s")
MACHINE = {"pole_pairs": 4, "log": {"regime": "dynamic"}}


def columns(rows: int) -> dict[str, np.ndarray]:
    """The log, and its time."""
    import dqwatch

    one = dqwatch.simulate(scenario="servo")
    times = -(-rows // len(one))
    out = {name: np.tile(one[name], times)[:rows] for name in NAMES}
    out["t_s"] = np.arange(rows) * 1e-4
    return out


def peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def resident_bytes() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def child(how: str, path: str, rows: int) -> None:
    """One fit in a process of its own: prints processor seconds, and bytes beyond what it held before."""
    import dqwatch

    log = {n: np.load(f"{path}.{n}.npy") for n in NAMES} if how == "arrays" else path
    before, begun = resident_bytes(), sum(os.times()[:2])
    found = dqwatch.fit(log, machine=MACHINE)
    assert found.rows_used == rows
    print(sum(os.times()[:2]) - begun, peak_bytes() - before)


def main() -> int:
    if sys.argv[1] == "--child":
        child(sys.argv[2], sys.argv[3], int(sys.argv[4]))
        return 0
    command, folder, rows = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 10**7
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "long.csv"
    log = columns(rows)
    with path.open("w") as file:
        file.write(",".join(NAMES) + "\n")
        for begin in range(0, rows, 100000):
            block = [log[n][begin : begin + 100000] for n in NAMES]
            np.savetxt(file, np.column_stack(block), fmt="%.12g,%.9g,%.9g,%.9g,%.9g,%.9g")
    path.with_suffix(".toml").write_text("[machine]\npole_pairs = 4\n[log]\nregime = 'dynamic'\n")
    for name in NAMES:
        np.save(f"{path}.{name}.npy", log[name])
    size = sum(column.nbytes for column in log.values())
    del log

    def run(how: str) -> tuple[float, float]:
        done = subprocess.run(
            [sys.executable, __file__, "--child", how, str(path), str(rows)], check=True, capture_output=True, text=True
        )
        seconds, extra = done.stdout.split()
        return float(seconds), float(extra)

    begun = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([command, "fit", str(path)], check=True, capture_output=True)
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = ended.ru_utime + ended.ru_stime - begun.ru_utime - begun.ru_stime
    print(f"{rows} rows of {len(NAMES)} columns, {size / 1e6:.0f} MB: one fit, reading included")
    print(f"command          {seconds:7.1f} s   {ended.ru_maxrss * 1024 / size:.2f} of the input's memory")
    for how in ("path", "arrays"):
        mine, extra = run(how)
        more = f"{mine / seconds:.2f} of the command's; {extra / size:.2f} of the input's memory"
        print(f"dqwatch.fit, {how:<7}{mine:6.1f} s, {more}")
    for name in NAMES:
        os.remove(f"{path}.{name}.npy")
    path.unlink()
    return 0


if __name__ == "__main__":
    sys.exit(main())
