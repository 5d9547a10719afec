#!/usr/bin/env python3
"""Drives of the public firmware rombrew/phobia, its own controller on its own plant, monitored by the command: healthy
ones drawn by a seed, one by one, then faults. Tables on stdout. `make strangers PHOBIA=` builds what it runs.

usage: phobia.py [--build DIR] [--seed N] [--drives N] [--faults N]
"""

from __future__ import annotations

import argparse
import json
import pathlib
import random
import subprocess
import tempfile

from campaign import command
from campaign.command import PARAMETERS, Tools

# Motors of hobby data sheets.
MOTORS = {
    "rotomax": {"R_ohm": 14e-3, "Ld_H": 10e-6, "Lq_H": 15e-6, "Kv_rpm_V": 270, "pole_pairs": 14, "J_kgm2": 4e-4,
                "v_dc_V": 22},
    "hub": {"R_ohm": 0.24, "Ld_H": 520e-6, "Lq_H": 650e-6, "Kv_rpm_V": 15, "pole_pairs": 15, "J_kgm2": 6e-3,
            "v_dc_V": 48, "source_ohm": 0.5},
    "skate": {"R_ohm": 35e-3, "Ld_H": 14e-6, "Lq_H": 20e-6, "Kv_rpm_V": 190, "pole_pairs": 7, "J_kgm2": 3e-4,
              "v_dc_V": 44},
    "gimbal": {"R_ohm": 0.1, "Ld_H": 45e-6, "Lq_H": 60e-6, "Kv_rpm_V": 100, "pole_pairs": 11, "J_kgm2": 8e-4,
               "v_dc_V": 36},
    "bike": {"R_ohm": 90e-3, "Ld_H": 160e-6, "Lq_H": 210e-6, "Kv_rpm_V": 40, "pole_pairs": 8, "J_kgm2": 4e-3,
             "v_dc_V": 50},
}
# Where it puts the zero vector; the last, by the larger current of two phases, is none that the command knows.
ZEROS = ("clamped_low", "centred", "of the current")
FAULT_S = 10.0
FAULTS = {
    "resistance_rise": {"fault_R": 1.3},
    "demagnetisation": {"fault_psi": 0.95},
    "current_gain": {"fault_gain_a": 1.05},
    "current_offset": {"fault_offset_A": 1.0},
    "inverter_fault": {"fault_dead_s": 200e-9},
    "unknown": {"fault_Lq": 0.85},
}


def drive(build: pathlib.Path, folder: pathlib.Path, motor: str, told: bool,
          settings: dict[str, float]) -> tuple[pathlib.Path, dict[str, float]]:
    """A log with its machine file, and the machine at its end."""
    csv = folder / "log.csv"
    program = build / "strangers" / "phobia" / "drive"
    pairs = [f"{key}={value}" for key, value in (MOTORS[motor] | settings).items()]
    done = subprocess.run([program, csv, *pairs], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{motor}: {done.stderr.strip()[-200:]}")
    lines = ["[log]", 'regime = "dynamic"', f'angle = "{"encoder" if settings["encoder"] else "observer"}"']
    if told:
        lines.append(f'modulation = "{ZEROS[int(settings["zero"])]}"')
    lines += ["[machine]", f'pole_pairs = {MOTORS[motor]["pole_pairs"]}']
    csv.with_suffix(".toml").write_text("\n".join(lines) + "\n")
    return csv, json.loads(done.stderr)


def said(events: list[dict]) -> str:
    return ", ".join(f'{e["fault"]} at {e["t_s"]:.1f} s' for e in events) or "none"


def healthy(tools: Tools, seed: int, count: int) -> None:
    print("| drive | arithmetic | events | R, % | L_d | L_q | ψ |\n| --- | --- | --- | --: | --: | --: | --: |")
    events_of, usable, within, worst = 0, 0, 0, 0.0
    for n in range(count):
        r = random.Random(1000 * seed + n)
        motor = list(MOTORS)[n % len(MOTORS)]
        settings = {"encoder": r.choice((0, 0, 1)), "zero": r.choice((0, 0, 1, 2)), "seed": r.randrange(1, 10**6),
                    "speed": round(r.uniform(0.35, 0.8), 2), "dead_s": r.choice((90e-9, 90e-9, 200e-9, 400e-9))}
        with tempfile.TemporaryDirectory() as folder:
            csv, truth = drive(tools.build, pathlib.Path(folder), motor, False, settings)
            for arith in ("float", "q15"):
                events = command.events(tools, csv, arith)
                reads = command.monitor_reads(tools, csv, arith)
                events_of += len(events)
                cells = []
                for name in PARAMETERS:
                    x = reads[name]
                    if not x:
                        cells.append("–")
                        continue
                    off, sd = 100 * (x["value"] / truth[name] - 1), 100 * x["sd"] / truth[name]
                    cells.append(f"{off:+.2f} ± {sd:.2g}" if x["usable"] else "not usable")
                    if x["usable"]:
                        usable, within, worst = usable + 1, within + (abs(off) <= 3 * sd), max(worst, abs(off))
                sensor = "encoder" if settings["encoder"] else "observer"
                title = f'{n} {motor}, {sensor}, {ZEROS[int(settings["zero"])]}, {1e9 * settings["dead_s"]:.0f} ns'
                print(f"| {title} | {arith} | {said(events)} | {' | '.join(cells)} |", flush=True)
    print(f"\n{count} healthy drives of 20 s, untold of their modulation, twice: {events_of} events; of {usable} usable "
          f"parameters {within} within three deviations, the worst {worst:.1f} % off.\n")


def faults(tools: Tools, seed: int, count: int) -> None:
    print("| fault | sensor | drives | right | unknown | wrong | silent | before |\n"
          "| --- | --- | --: | --: | --: | --: | --: | --: |")
    for name, keys in FAULTS.items():
        for encoder in (1, 0):
            right = unknown = wrong = silent = before = 0
            for n in range(count):
                settings = {"encoder": encoder, "zero": 0, "seed": 1000 * seed + n, "speed": 0.5, "fault_s": FAULT_S}
                with tempfile.TemporaryDirectory() as folder:
                    csv, _ = drive(tools.build, pathlib.Path(folder), list(MOTORS)[n % len(MOTORS)], True,
                                   settings | keys)
                    for arith in ("float", "q15"):
                        events = command.events(tools, csv, arith)
                        before += sum(e["t_s"] < FAULT_S for e in events)
                        names = [e["fault"] for e in events if e["t_s"] >= FAULT_S]
                        first = next((x for x in names if x != "unknown"), names[0] if names else "")
                        right, unknown = right + (first == name), unknown + (first == "unknown" != name)
                        silent, wrong = silent + (not first), wrong + (first not in ("", "unknown", name))
            sensor = "encoder" if encoder else "observer"
            print(f"| {name} | {sensor} | {2 * count} | {right} | {unknown} | {wrong} | {silent} | {before} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", type=pathlib.Path, default=pathlib.Path("build"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drives", type=int, default=20)
    parser.add_argument("--faults", type=int, default=5)
    given = parser.parse_args()
    tools = Tools(given.build.absolute())
    healthy(tools, given.seed, given.drives)
    faults(tools, given.seed, given.faults)


if __name__ == "__main__":
    main()
