#!/usr/bin/env python3
"""Drives drawn by a seed through the command, as a user has it: do the deviations hold, are faults named rightly and
with the confidence stated, does it stay quiet? Markdown on stdout; what was measured as JSON in BUILD/campaign.

usage: campaign.py coverage|faults|alarms|all [--build DIR] [--seed N] [--drives N] [--per N] [--samples N] [--jobs N]
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import os
import pathlib
import sys
import time
from collections.abc import Callable, Iterable

from campaign import alarms, coverage, faults
from campaign.command import Tools


def each(jobs: int, what: Callable, over: Iterable) -> list:
    """Every job's result, in order; one that fails is said, and left out."""
    out = []
    with concurrent.futures.ProcessPoolExecutor(jobs) as pool:
        for number, future in enumerate([pool.submit(what, job) for job in over]):
            try:
                out.append(future.result())
            except RuntimeError as error:
                print(f"campaign: {number}: {error}", file=sys.stderr)
    return out


def kept(args: argparse.Namespace, name: str, found: object) -> None:
    folder = pathlib.Path(args.build) / "campaign"
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(found))


def run_coverage(args: argparse.Namespace, tools: Tools) -> None:
    drives = coverage.drives(args.seed, args.drives)
    runs = [run for found in each(args.jobs, coverage.one, [(tools, d, k) for k, d in enumerate(drives)]) for run in found]
    kept(args, "coverage", runs)
    coverage.report(runs)


def run_faults(args: argparse.Namespace, tools: Tools) -> None:
    runs = [run for found in each(args.jobs, faults.one, [(tools, c) for c in faults.cases(args.seed, args.per)]) for run in found]
    kept(args, "faults", runs)
    faults.report(runs)


def run_alarms(args: argparse.Namespace, tools: Tools) -> None:
    drives = alarms.drives(args.seed, args.samples)
    runs = [run for found in each(args.jobs, alarms.one, [(tools, d) for d in drives]) for run in found]
    kept(args, "alarms", runs)
    alarms.report(runs)


PARTS = {"coverage": run_coverage, "faults": run_faults, "alarms": run_alarms}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=[*PARTS, "all"])
    parser.add_argument("--build", default="build")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drives", type=int, default=160, help="of coverage")
    parser.add_argument("--per", type=int, default=10, help="drives of each fault and severity, with encoder and with observer")
    parser.add_argument("--samples", type=float, default=2e7, help="of alarms")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    tools = Tools(pathlib.Path(args.build).absolute())
    print("# A campaign of drives drawn by a seed\n\nBy `make campaign`; one part: `python3 bench/campaign.py PART --seed N`. "
          f"Seed {args.seed}.\n")
    for name in PARTS if args.part == "all" else [args.part]:
        start = time.monotonic()
        PARTS[name](args, tools)
        print(f"campaign: {name} took {time.monotonic() - start:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
