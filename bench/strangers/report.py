"""The strangers in figures: sets, names on clean and outside logs, parameters, and each log that went wrong."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable

from campaign.figures import share, table

# Three deviations, or so much of the value.
SMALL, GROSS = 0.01, 0.15


def line(what: str, hits: int, n: int, wanted: str) -> list[str]:
    return [what, f"{hits} of {n}", share(hits, n), wanted]


def within(p: dict, deviations: float) -> bool:
    return abs(p["error"]) <= max(deviations * p["sd"], SMALL)


def truth_text(run: dict) -> str:
    return ", ".join([*run["effects"], *(f"outside: {name}" for name in run["outside"])]) or "nothing"


def named_text(run: dict) -> str:
    return ", ".join("/".join([name, *other]) for name, other in zip(run["named"], run["others"])) or "–"


def sums(runs: list[dict]) -> None:
    def of(kinds: Iterable[str], also: Callable[[dict], bool] = lambda r: True) -> list[dict]:
        return [r for r in runs if r["kind"] in kinds and also(r)]

    sets = of(("one", "two"), lambda r: not r["hidden"])
    clear = [r for r in sets if r["strength"] >= 3]
    clean, outside = of(("clean",)), of(("outside",))
    rows = [
        line("sets right", sum(r["right"] for r in sets), len(sets), "92 %"),
        line("of these above 3 times the floor", sum(r["right"] for r in clear), len(clear), "–"),
        line("clean, named", sum(bool(r["named"]) for r in clean), len(clean), "0"),
        line("clean, said to be structured", sum(not r["named"] and r["verdict"] != "clean" for r in clean),
             len(clean), "–"),
        line("outside, named", sum(not r["right"] for r in outside), len(outside), "3 % at most"),
        line("outside, taken for clean",
             sum(r["verdict"] == "clean" and not r["hidden"] for r in outside), len(outside), "–"),
        line("below 1.5 times the floor, named wrongly", sum(not r["right"] for r in runs if r["hidden"]),
             sum(r["hidden"] for r in runs), "0")]
    known = [p for r in runs for p in r["parameters"].values()]
    usable = [p for p in known if p["usable"]]
    rows += [
        line("usable parameters within 3 deviations or 1 %", sum(within(p, 3) for p in usable), len(usable), "97 %"),
        line("usable parameters within 2 deviations or 1 %", sum(within(p, 2) for p in usable), len(usable), "–"),
        line("usable parameters over 15 % off", sum(abs(p["error"]) > GROSS for p in usable), len(usable), "0"),
        line("parameters that are usable", len(usable), 4 * len(runs), "–")]
    table(("", "logs", "% (95 %)", "wanted"), rows)
    seconds = sorted(r["seconds"] for r in runs)
    if seconds:
        print(f"Processor time of a trace: median {seconds[len(seconds) // 2]:.1f} s, longest {seconds[-1]:.1f} s.\n")


def each_parameter(runs: list[dict]) -> None:
    rows = []
    for name in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb"):
        usable = [r["parameters"][name] for r in runs if r["parameters"].get(name, {}).get("usable")]
        worst = max((abs(p["error"]) for p in usable), default=0.0)
        rows.append([name, share(len(usable), len(runs)), share(sum(within(p, 2) for p in usable), len(usable)),
                     share(sum(within(p, 3) for p in usable), len(usable)), f"{100 * worst:.1f}"])
    table(("", "usable %", "within 2 or 1 % of these", "within 3 or 1 %", "worst %"), rows)


def each_effect(runs: list[dict]) -> None:
    rows: dict[str, Counter[str]] = {}
    for r in runs:
        name = truth_text(r)
        row = rows.setdefault(name, Counter())
        row["logs"] += 1
        row["right"] += r["right"]
        row["hidden"] += r["hidden"]
        if not r["right"]:
            row[f"said {named_text(r)} ({r['verdict']})"] += 1
    table(("truth", "logs", "right", "hidden", "instead"),
          [[name, row["logs"], row["right"], row["hidden"],
            "; ".join(f"{key[5:]} {n}" for key, n in row.items() if key.startswith("said "))]
           for name, row in sorted(rows.items())])


def wrong(runs: list[dict]) -> list[dict]:
    return [r for r in runs if not r["right"] or r["failure"] or (r["kind"] == "clean" and r["verdict"] != "clean") or
            any(p["usable"] and not within(p, 3) for p in r["parameters"].values())]


def failures(runs: list[dict], repeat: str) -> None:
    for r in wrong(runs):
        name = "WRONG" if not r["right"] or r["failure"] else "OFF  "
        offs = " ".join(f"{key} {100 * p['error']:+.2g} % ({p['error'] / p['sd'] if p['sd'] else 0:+.1f} sd)"
                        for key, p in r["parameters"].items() if p["usable"] and not within(p, 3))
        strength = f" ({r['strength']:.1f}x)" if math.isfinite(r["strength"]) else ""
        print(f"{name} {r['seed']} {r['simulator']} {r['plate']}: {truth_text(r)}{strength}: "
              f"{r['failure'] or r['verdict']}: [{named_text(r)}]{' off: ' + offs if offs else ''}")
        print(f"    {repeat} --seed {r['seed']}")


def report(runs: list[dict], repeat: str) -> None:
    sums(runs)
    each_parameter(runs)
    each_effect(runs)
    failures(runs, repeat)
