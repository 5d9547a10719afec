#!/usr/bin/env python3
"""Logs of drives of the public firmware rombrew/phobia, its own controller on its own switching plant, drawn by a seed,
traced by the command, judged by what was put in, also where noise covers it. Tables on stdout. `make strangers PHOBIA=`
builds what it runs.

usage: phobia_logs.py [--build DIR] [--from SEED] [--count N] [--jobs N] | --seed SEED
"""

from __future__ import annotations

import argparse
import cmath
import concurrent.futures
import dataclasses
import json
import math
import os
import pathlib
import random
import resource
import subprocess

from phobia import MOTORS, ZEROS
from strangers import judge, report

AMPERE = {"rotomax": 30, "hub": 12, "skate": 25, "gimbal": 15, "bike": 20}
KINDS = ("clean", "dead_time", "centred", "dead_time", "of the current", "angle_offset", "voltage_scale", "current_offset",
         "current_gain_mismatch", "filter", "rows_apart", "dead_time, angle_offset", "clean", "centred",
         "dead_time, current_gain_mismatch")
LATER = ("angle_offset", "voltage_scale", "current_offset", "current_gain_mismatch")
ROWS = 15000
# Its converter takes one current 0.64 us after the other, behind an amplifier of 0.64 us: what is as late is in truth.
SAMPLING_S = 1.3e-6


@dataclasses.dataclass
class Spec:
    """A drive, and what is done to its log: its angle turned, offsets in two phases' axes, a filter, rows apart."""

    motor: str
    settings: dict[str, float]
    effects: list[str]
    outside: list[str]
    angle_rad: float = 0.0
    offset_A: complex = 0j
    filter_rows: float = 0.0
    stator: bool = False
    rows_apart: int = 0


def either(r: random.Random, low: float, high: float) -> float:
    return r.choice((-1, 1)) * r.uniform(low, high)


def draw(seed: int) -> Spec:
    r = random.Random(f"phobia {seed}")
    motor = r.choice(list(MOTORS))
    machine, ampere = dict(MOTORS[motor]), AMPERE[motor]
    L = r.uniform(0.8, 1.3)
    for name, times in (("R_ohm", r.uniform(0.7, 1.4)), ("Ld_H", L), ("Lq_H", L * r.uniform(0.9, 1.3)),
                        ("Kv_rpm_V", r.uniform(0.85, 1.15))):
        machine[name] *= times
    # Ten samples in L/R, and pulses that move the current by no more than what flows.
    periods = [T for T in (35e-6, 5e-5, 1e-4) if machine["R_ohm"] * T < 0.1 * machine["Ld_H"] and
               machine["v_dc_V"] * T < 16 * ampere * machine["Ld_H"]]
    period_s = r.choice(periods or [35e-6])
    hold_s = r.choice((0.005, 0.02, 0.05))
    kind = KINDS[seed % len(KINDS)]
    parts = kind.split(", ")
    settings = machine | {
        "encoder": 2, "period_s": period_s, "speed_s": 5 * hold_s, "load_s": hold_s, "duration_s": (ROWS + 100) * period_s,
        "i_d_A": ampere * r.uniform(0.2, 0.6), "load_A": ampere * r.uniform(0.4, 0.8), "speed": r.uniform(0.4, 0.8),
        "seed": r.randrange(1, 10**6), "dead_s": 0.0, "zero": r.choice((0, 0, 1))}
    spec = Spec(motor, settings, [part for part in parts if part in LATER], [])
    if parts[0] in ("dead_time", *ZEROS):
        spec.effects = ["dead_time", *parts[1:]]
        settings["dead_s"] = r.choice((1.5e-7, 3e-7, 6e-7))
        settings["zero"] = ZEROS.index(parts[0]) if parts[0] in ZEROS else 0
    if "angle_offset" in parts:
        spec.angle_rad = either(r, 0.03, 0.12)
    if kind == "voltage_scale":
        settings |= {"nominal": 1, "source_ohm": machine["v_dc_V"] / ampere * r.uniform(0.03, 0.08)}
    if kind == "current_offset":
        spec.offset_A = ampere * complex(r.uniform(-0.04, 0.04), r.uniform(-0.04, 0.04))
    if "current_gain_mismatch" in parts:
        settings["gain_a"] = 1 + either(r, 0.03, 0.08)
    if kind == "filter":
        spec.effects, spec.filter_rows, spec.stator = ["sensor_lag"], r.choice((0.5, 1, 2, 4)), r.random() < 0.5
    if kind == "rows_apart":
        spec.outside, spec.rows_apart = ["rows_apart"], r.choice((-3, -2, 2, 3))
    return spec


def spoiled(spec: Spec, rows: list[list[float]]) -> list[list[float]]:
    """t_s, v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad, as sensors and firmware that were drawn would log them."""
    before, out = None, []
    for k, (t, _, _, i_d, i_q, w, theta) in enumerate(rows):
        v_d, v_q = rows[min(max(k - spec.rows_apart, 0), len(rows) - 1)][1:3]
        v, i = complex(v_d, v_q), complex(i_d, i_q)
        i += spec.offset_A * cmath.exp(-1j * theta)
        if spec.filter_rows:
            frame = cmath.exp(1j * theta) if spec.stator else 1.0
            before = i * frame if before is None else before + (i * frame - before) / (1 + spec.filter_rows)
            i = before / frame
        turn = cmath.exp(-1j * spec.angle_rad)
        v, i, theta = v * turn, i * turn, math.remainder(theta + spec.angle_rad, 2 * math.pi)
        out.append([t, v.real, v.imag, i.real, i.imag, w, theta])
    return out


def make(build: pathlib.Path, seed: int, folder: pathlib.Path) -> str:
    """Writes the log and its truth; why not, where the firmware does not start."""
    spec, csv = draw(seed), folder / f"phobia_{seed}.csv"
    pairs = [f"{key}={value!r}" for key, value in spec.settings.items()]
    done = subprocess.run([build / "strangers" / "phobia" / "drive", csv, *pairs], capture_output=True, text=True)
    if done.returncode != 0:
        return done.stderr.strip()[-200:]
    machine = json.loads(done.stderr)
    # In amperes of the gain that its sensors share.
    for name in ("R_ohm", "Ld_H", "Lq_H"):
        machine[name] *= 3 / (2 + spec.settings.get("gain_a", 1.0))
    head, *lines = csv.read_text().split()
    rows = spoiled(spec, [[float(x) for x in line.split(",")] for line in lines[:ROWS]])
    start = rows[0][0]
    csv.write_text("\n".join([head, *(",".join([f"{t - start:.7f}", *(f"{x:.6g}" for x in rest)])
                                      for t, *rest in rows)]) + "\n")
    csv.with_suffix(".toml").write_text(
        f'[log]\nregime = "dynamic"\n[machine]\npole_pairs = {int(spec.settings["pole_pairs"])}\n')
    kind = "outside" if spec.outside else ("clean", "one", "two")[len(spec.effects)]
    csv.with_suffix(".truth.json").write_text(json.dumps(
        {"spec": {"seed": seed, "kind": kind, "outside": spec.outside, "log": {"theta": True}},
         "strength": math.inf, "truth": [[name] for name in spec.effects],
         "parameters": {n: [v, v, v] for n, v in machine.items()}}))
    return ""


def beyond_sampling(said: dict) -> dict:
    """Without a shift or a lag of the currents that is its converter's own."""
    def own(e: dict) -> bool:
        late = e["name"] in ("sample_shift", "sensor_lag")
        return late and all(abs(p["value"]) < SAMPLING_S for p in e["parameters"].values())
    left = [e for e in said.get("effects", []) if not own(e)]
    clean = said.get("verdict") == "explained" and not left
    return said | {"effects": left} | ({"verdict": "clean"} if clean else {})


def one(job: tuple[pathlib.Path, int]) -> dict | str:
    """A log traced; what went wrong before."""
    build, seed = job
    folder = build / "strangers" / "phobia" / "logs"
    folder.mkdir(parents=True, exist_ok=True)
    if failure := make(build, seed, folder):
        return f"no log: seed {seed}: {failure}"
    csv, spec = folder / f"phobia_{seed}.csv", draw(seed)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([build / "dqwatch", "trace", csv, "--json", "--out", folder / f"phobia_{seed}"],
                          capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = json.loads(done.stdout) if done.returncode == 0 else {}
    truth = json.loads(csv.with_suffix(".truth.json").read_text())
    return {"seed": seed, "simulator": "phobia", "plate": spec.motor, "kind": truth["spec"]["kind"],
            "effects": spec.effects, "outside": spec.outside, "strength": truth["strength"],
            "seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            "failure": "" if done.returncode == 0 else done.stderr.strip()[-200:],
            **judge.score(truth, beyond_sampling(said))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build"))
    parser.add_argument("--from", type=int, default=1000, dest="first")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, help="that one log; what trace says, in full")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    given = parser.parse_args()
    build = given.build.absolute()
    if given.seed is not None:
        answer = one((build, given.seed))
        print(answer if isinstance(answer, str) else json.dumps(answer, indent=1))
        if isinstance(answer, str):
            return
        folder = build / "strangers" / "phobia" / "logs"
        subprocess.run([build / "dqwatch", "trace", folder / f"phobia_{given.seed}.csv", "--out",
                        folder / f"phobia_{given.seed}"])
        return
    with concurrent.futures.ProcessPoolExecutor(given.jobs) as pool:
        answers = list(pool.map(one, [(build, seed) for seed in range(given.first, given.first + given.count)]))
    for answer in answers:
        if isinstance(answer, str):
            print(answer)
    report.report([a for a in answers if isinstance(a, dict)],
                  "python3 bench/phobia_logs.py" + (f" --build {given.build}" if given.build != pathlib.Path("build") else ""))


if __name__ == "__main__":
    main()
