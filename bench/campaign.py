#!/usr/bin/env python3
"""Drives drawn by a seed through the command, as a user has it: do the deviations hold, are faults named rightly and
with the confidence stated, does it stay quiet? Markdown on stdout; what was measured as JSON in BUILD/campaign.

usage: campaign.py coverage|faults|alarms|all [--build DIR] [--seed N] [--drives N] [--per N] [--samples N] [--jobs N]
       [--read]
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


def each(args: argparse.Namespace, part: str, what: Callable, over: Iterable) -> list[dict]:
    """What every job found, kept line by line as it comes; of --read what was kept before. A job that fails is said."""
    file = pathlib.Path(args.build) / "campaign" / f"{part}_{args.seed}.jsonl"
    file.parent.mkdir(exist_ok=True)
    if not args.read:
        jobs = list(over)
        with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool, file.open("w") as out:
            for done, future in enumerate(concurrent.futures.as_completed([pool.submit(what, job) for job in jobs]), 1):
                try:
                    for run in future.result():
                        print(json.dumps(run), file=out, flush=True)
                except RuntimeError as error:
                    print(f"campaign: {error}", file=sys.stderr)
                if done % 10 == 0:
                    print(f"campaign: {part}, {done} of {len(jobs)}", file=sys.stderr)
    found = [json.loads(line) for line in file.open()]
    return sorted(found, key=lambda run: run["number"])


def run_coverage(args: argparse.Namespace, tools: Tools) -> None:
    drives = coverage.drives(args.seed, args.drives)
    coverage.report(each(args, "coverage", coverage.one, [(tools, d, k) for k, d in enumerate(drives)]))


def run_faults(args: argparse.Namespace, tools: Tools) -> None:
    faults.report(each(args, "faults", faults.one, [(tools, c) for c in faults.cases(args.seed, args.per)]))


def run_alarms(args: argparse.Namespace, tools: Tools) -> None:
    drives = alarms.drives(args.seed, args.samples)
    alarms.report(each(args, "alarms", alarms.one, [(tools, d, k) for k, d in enumerate(drives)]))


PARTS = {"coverage": run_coverage, "faults": run_faults, "alarms": run_alarms}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=[*PARTS, "all"])
    parser.add_argument("--build", default="build")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drives", type=int, default=120, help="of coverage")
    parser.add_argument("--per", type=int, default=6, help="of each fault and severity, with encoder and with observer")
    parser.add_argument("--samples", type=float, default=2e7, help="of alarms")
    parser.add_argument("--read", action="store_true", help="run nothing: report what BUILD/campaign has of this seed")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    tools = Tools(pathlib.Path(args.build).absolute())
    print("# A campaign of drives drawn by a seed\n")
    print(f"`make campaign`, or `python3 bench/campaign.py {args.part} --seed {args.seed} --drives {args.drives} "
          f"--per {args.per} --samples {args.samples:g}`, which\nis what this is of. A drive's number repeats it.\n")
    for name in PARTS if args.part == "all" else [args.part]:
        start = time.monotonic()
        PARTS[name](args, tools)
        print(f"campaign: {name} took {time.monotonic() - start:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
