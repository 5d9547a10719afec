"""The command line of ``dqwatch fleet``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence


def _parser() -> argparse.ArgumentParser:
    p = argparse.ArgumentParser(prog="dqwatch fleet", description="Fit every log of a fleet, compare its motors.")
    p.add_argument("logs", nargs="+", metavar="LOGS", help="folders, globs or files: Parquet, or what dqwatch reads")
    p.add_argument("--out", required=True, metavar="DIR", help="folder for windows/, fleet.html, standing.csv")
    p.add_argument("--motors", metavar="FILE", help="table: motor, type, pole_pairs, batch, axis, site, firmware")
    p.add_argument(
        "--regime",
        default="",
        choices=["polled", "dynamic", "steady", "standstill", "mechanical"],
        help="of all logs, where their rows do not tell",
    )
    p.add_argument("--engine", default="duckdb", choices=["duckdb", "spark"])
    p.add_argument("--memory", default="4GB", help="bound, such as 4GB (default) or 512MiB")
    p.add_argument("--threads", type=int, metavar="N", help="default: all cores")
    return p


def main(argv: Sequence[str]) -> int:
    """Runs the subcommand; argv without its word. Exit code 0 with and without motors that stand out, 3 where there is
    nothing to read."""
    a = _parser().parse_args(list(argv))
    try:
        from .api import fleet
    except ModuleNotFoundError as error:
        print(f"dqwatch: fleet needs {error.name}; pip install './python[fleet]'", file=sys.stderr)
        return 1
    watched = sys.stderr.isatty()

    def told(done: int, new: int) -> None:
        if watched:
            print(f"\r{done} of {new} new files", end="\n" if done == new else "", file=sys.stderr)

    try:
        result = fleet(
            a.logs,
            a.out,
            motors=a.motors,
            regime=a.regime,
            engine=a.engine,
            memory=a.memory,
            threads=a.threads,
            told=told,
        )
    except KeyboardInterrupt:
        print("dqwatch: stopped; the same command goes on from here", file=sys.stderr)
        return 130
    except (OSError, ValueError, RuntimeError) as error:
        print(f"dqwatch: {error}", file=sys.stderr)
        return 3
    from .text import text_of

    print(text_of(result))
    return 0
