"""Part 3: does the monitor stay quiet, and does it come into service? Healthy switching drives only, each log through
both arithmetics."""

from __future__ import annotations

import pathlib
import random
import tempfile

from . import command, figures
from .command import Tools
from .drives import IMPERFECTIONS, MACHINES, OF_ENCODER, Drive, drawn

SECONDS = (15.0, 40.0)
SERVICE_S = 10.0
# What says another machine than the log's: not healthy as the user sees it.
LEFT_OUT = ("decided voltage logged",)


def drives(seed: int, samples: float) -> list[Drive]:
    """Every second with an observer; half of them warm up; one to three imperfections beside that."""
    r = random.Random(f"alarms {seed}")
    chosen: list[Drive] = []
    gathered = 0.0
    while gathered < samples:
        observed = len(chosen) % 2 == 1
        names = [name for name in IMPERFECTIONS if name not in (*LEFT_OUT, "observer", "heat", "dead time")]
        names = [name for name in names if not (observed and name in OF_ENCODER) and "nominal" not in name]
        picked = ["dead time", *(["observer"] if observed else []), *(["heat"] if r.random() < 0.5 else []),
                  *r.sample(names, r.randint(0, 2))]
        chosen.append(drawn(r, MACHINES[len(chosen) // 2 % len(MACHINES)], tuple(picked), SECONDS))
        gathered += chosen[-1].duration_s / chosen[-1].machine.dt_s
    return chosen


def one(job: tuple[Tools, Drive, int]) -> list[dict]:
    tools, drive, number = job
    found = []
    with tempfile.TemporaryDirectory() as folder:
        sim = command.simulate(tools, drive, pathlib.Path(folder))
        command.tell(sim, True)
        for arith in ("float", "q15"):
            since_s, why = command.service(tools, sim.csv, arith)
            found.append(command.about(drive) | {
                "number": number, "arith": arith, "samples": drive.duration_s / drive.machine.dt_s,
                "duration_s": drive.duration_s, "service_s": since_s, "why": why,
                "events": command.events(tools, sim.csv, arith), "repeat": command.repeat(drive)})
    return found


def report(runs: list[dict]) -> None:
    print("## False alarms\n\nHealthy drives that switch, with dead time, every second with an observer, half of them "
          f"warming up, and up to two\nfurther imperfections; {SECONDS[0]:g} to {SECONDS[1]:g} s each, told as above. "
          "Every event is false (wanted none). In service within\n10 s (wanted 95 %): from the log's beginning.\n")
    rows = []
    for arith in ("float", "q15"):
        for name, kind in (("encoder", False), ("observer", True)):
            part = [run for run in runs if run["arith"] == arith and run["observed"] == kind]
            soon = sum(run["service_s"] is not None and run["service_s"] <= SERVICE_S for run in part)
            rows.append([f"{arith}, {name}", len(part), f"{sum(run['samples'] for run in part):.3g}",
                         sum(len(run["events"]) for run in part), sum(bool(run["events"]) for run in part),
                         figures.share(soon, len(part))])
    figures.table(("monitor", "drives", "samples", "events", "drives with one", "in service within 10 s, %"), rows)
    late = [run for run in runs if run["service_s"] is None or run["service_s"] > SERVICE_S]
    if late:
        print("Not within 10 s:\n")
        figures.table(("drive", "arithmetic", "when", "what the command says"), [
            [command.where(run), run["arith"],
             "never" if run["service_s"] is None else f"{run['service_s']:.1f} s", run["why"]] for run in late])
    alarmed = [(run, event) for run in runs for event in run["events"]]
    if alarmed:
        print("Events:\n")
        figures.table(("drive", "arithmetic", "at, s", "fault", "confidence", "parameter", "value", "healthy"), [
            [command.where(run), run["arith"], f"{e['t_s']:.2f}", e["fault"], e["confidence"], e["parameter"],
             f"{e['value']:.4g}" if e["value"] is not None else "–",
             f"{e['healthy']:.4g}" if e["healthy"] is not None else "–"] for run, e in alarmed])
        print("Each by one command; its log is then watched with `dqwatch monitor`, with the machine file that `sim` "
              "writes:\n\n```sh")
        print("\n".join(dict.fromkeys(run["repeat"] for run, _ in alarmed)) + "\n```\n")
