"""``python -m dqwatch.fleet.demo``: a small simulated fleet, what is wrong with it, and what is found."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path

from .api import fleet
from .simulated.planted import drawn
from .simulated.write import write
from .text import text_of


def main(argv: Sequence[str]) -> int:
    """Writes a fleet's logs into a folder, compares its motors, prints who stands out beside what was planted."""
    p = argparse.ArgumentParser(prog="python -m dqwatch.fleet.demo", description=main.__doc__)
    p.add_argument("--out", default="fleet-demo", metavar="DIR")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--motors", type=int, default=60)
    a = p.parse_args(list(argv))
    root = Path(a.out)
    drawn_fleet = drawn(a.seed, a.motors, rows=1200, each=1, batch=5)
    if (root / "planted.csv").exists():
        print(f"logs of a simulated fleet: {root / 'logs'}, as they are there")
    else:
        print(f"drawing {a.motors} motors, {drawn_fleet.weeks} weekly logs each: {root / 'logs'}", flush=True)
        write(drawn_fleet, root)
    result = fleet(root / "logs", root / "out")
    print(text_of(result))
    said = {s.motor: s.cause for s in result.comparison.standing}
    with open(root / "planted.csv", newline="") as file:
        planted = {r["motor"]: r["planted"] for r in csv.DictReader(file)}
    right = sum(said.get(m) == what for m, what in planted.items())
    print(f"planted: {len(planted)}, found and rightly named: {right}, false: {len(set(said) - set(planted))}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
