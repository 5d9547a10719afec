#!/usr/bin/env python3
"""Logs of drives that other projects' simulators drive, motulator and gym-electric-motor, drawn by a seed, traced by
the command, judged by what was put in. Tables on stdout; logs and answers stay in BUILD/strangers.

usage: strangers.py [--build DIR] [--from SEED] [--count N] [--jobs N] | --seed SEED | --read
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

from strangers import judge, report
from strangers.draw import draw

ENVIRONMENTS = {"motulator": "venv_motulator", "gem": "venv"}
PACKAGES = {"motulator": "motulator", "gem": "gym-electric-motor"}


DRAWS = ("draw", "drive", "gem_plant", "log", "motulator_plant", "simulate")


def up_to_date(truth: pathlib.Path) -> bool:
    """Whether its log is there, and younger than what draws it."""
    sources = pathlib.Path(__file__).parent / "strangers"
    newest = max((sources / f"{name}.py").stat().st_mtime for name in DRAWS)
    return truth.exists() and truth.stat().st_mtime > newest


def simulate(job: tuple[int, pathlib.Path, pathlib.Path]) -> tuple[int, str]:
    """Empty where its log is there."""
    seed, build, folder = job
    truth = folder / f"stranger_{seed}.truth.json"
    if up_to_date(truth):
        return seed, ""
    python = build / "bench" / ENVIRONMENTS[draw(seed).simulator] / "bin" / "python"
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([python, "-W", "ignore", "-m", "strangers.simulate", str(seed), str(folder)],
                          cwd=pathlib.Path(__file__).parent, capture_output=True, text=True,
                          env=os.environ | threads)
    return seed, "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["?"])[-1]


def available(build: pathlib.Path) -> set[str]:
    """Simulators whose environment is there; the others are said."""
    there = set()
    for name, folder in ENVIRONMENTS.items():
        module = "motulator" if name == "motulator" else "gym_electric_motor"
        python = build / "bench" / folder / "bin" / "python"
        if python.exists() and subprocess.run([python, "-W", "ignore", "-c", f"import {module}"],
                                              capture_output=True).returncode == 0:
            there.add(name)
        else:
            print(f"skipped: {PACKAGES[name]} (not installed; bench/strangers/logs.sh does)", file=sys.stderr)
    return there


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--from", type=int, default=100000, dest="first")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, help="that one log; what trace says, in full")
    parser.add_argument("--read", action="store_true", help="run nothing: report what is kept of these seeds")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    build = pathlib.Path(args.build).absolute()
    folder = build / "strangers" / "logs"
    folder.mkdir(parents=True, exist_ok=True)
    seeds = [args.seed] if args.seed is not None else list(range(args.first, args.first + args.count))
    kept = folder / "answers.jsonl"
    answers: dict[int, dict] = {}
    if args.read:
        for r in map(json.loads, kept.open()):
            answers[r["seed"]] = judge.again(folder / f"stranger_{r['seed']}.truth.json", r)
    else:
        there = available(build)
        wanted = [seed for seed in seeds if draw(seed).simulator in there]
        with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool, kept.open("a") as out:
            drawn = pool.map(simulate, [(seed, build, folder) for seed in wanted])
            ready = []
            for seed, failure in drawn:
                if failure:
                    print(f"no log: {failure}")
                else:
                    ready.append(folder / f"stranger_{seed}.truth.json")
            jobs = [pool.submit(judge.one, (build / "dqwatch", file)) for file in ready]
            for done, future in enumerate(concurrent.futures.as_completed(jobs), 1):
                run = future.result()
                answers[run["seed"]] = run
                print(json.dumps(run), file=out, flush=True)
                if sys.stderr.isatty():
                    print(f"\r{done} of {len(jobs)}", end="", file=sys.stderr)
    if args.seed is not None and args.seed in answers:
        print(json.dumps(answers[args.seed], indent=1))
        print((folder / f"stranger_{args.seed}.truth.json").read_text())
        subprocess.run([build / "dqwatch", "trace", folder / f"stranger_{args.seed}.csv", "--out",
                        folder / "trace" / f"stranger_{args.seed}"])
        return
    repeat = "python3 bench/strangers.py" + (f" --build {args.build}" if args.build != "build" else "")
    report.report([answers[seed] for seed in seeds if seed in answers], repeat)


if __name__ == "__main__":
    main()
