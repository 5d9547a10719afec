"""Part 2: each fault at two severities on drives that switch: named rightly, how soon, as surely as stated?"""

from __future__ import annotations

import dataclasses
import math
import pathlib
import random
import tempfile
from collections import Counter
from collections.abc import Callable

from . import command, figures
from .command import Tools
from .drives import IMPERFECTIONS, MACHINES, OF_ENCODER, Drive, Machine, Settings, drawn

START_S, GROWS_S, AFTER_S = 12.0, 0.1, 10.0
HEATING_K_S, LIMIT_K = 0.9, 110.0
BIN_LEAST = 30
# What a fault is made of, or what would be a fault itself.
LEFT_OUT = ("observer", "heat", "encoder turned", "decided voltage logged", "two sensors", "sensors' gains",
            "sensors' offsets", "dead time", "overmodulation")


@dataclasses.dataclass(frozen=True)
class Fault:
    """A ramp of `keys`; or a second run joined to the first, where a key cannot change in time; or a scaled voltage."""

    name: str
    severities: tuple[float, ...]
    of: str
    channel: str  # that shows it, as campaign_reads names it
    change: Callable[[Machine, float, Drive], float]  # of that channel, in its unit
    ramp: Callable[[Machine, float], Settings] | None = None
    also: Callable[[Machine, float], Settings] = lambda m, x: {}  # from the beginning
    joined: Callable[[Machine, float, Drive], Settings] | None = None
    after_s: float = AFTER_S
    expected: str = ""

    @property
    def right(self) -> str:
        return self.expected or self.name


def dead_s(drive: Drive) -> float:
    return float(drive.value("inverter.dead_time_s"))


SHORT_OHM, SHORT_H = 0.1, 1e-3  # of the phase

FAULTS = (
    Fault("demagnetisation", (0.03, 0.08), "of the flux", "psi_Wb", lambda m, x, d: x * m.psi_Wb,
          lambda m, x: {"nonideal.demagnetisation": x}),
    Fault("turn_short", (0.03, 0.08), "of a phase", "short_S",
          lambda m, x, d: x * x / (SHORT_OHM + x) / m.R_ohm / 3, lambda m, x: {"nonideal.turn_short": x},
          lambda m, x: {"nonideal.turn_short_ohm": SHORT_OHM * m.R_ohm, "nonideal.turn_short_H": SHORT_H * m.L_H}),
    Fault("phase_connection", (0.15, 0.5), "of R", "phase_resistance_ohm", lambda m, x, d: x * m.R_ohm / 3,
          lambda m, x: {"nonideal.phase_connection_ohm": x * m.R_ohm}),
    Fault("current_offset", (0.02, 0.06), "of the largest current", "offset_A", lambda m, x, d: x * m.i_max_A,
          lambda m, x: {"nonideal.current_offset_alpha_A": x * m.i_max_A}),
    Fault("current_gain", (0.06, 0.15), "of a sensor", "gain_H", lambda m, x, d: x * m.L_H / 3,
          lambda m, x: {"nonideal.current_gain_a": x}),
    Fault("encoder_offset", (0.05, 0.12), "rad", "psi_q_Wb", lambda m, x, d: x * m.psi_Wb,
          lambda m, x: {"nonideal.angle_offset_rad": x}),
    Fault("inverter_fault", (2, 4), "times the dead time", "dead_time_V",
          lambda m, x, d: (x - 1) * dead_s(d) / m.dt_s * m.v_dc_V,
          joined=lambda m, x, d: {"inverter.dead_time_s": x * dead_s(d)}),
    Fault("resistance_rise", (0.15, 0.4), "of R", "R_ohm", lambda m, x, d: x * m.R_ohm,
          joined=lambda m, x, d: {"machine.R_ohm": (1 + x) * m.R_ohm}),
    Fault("voltage_scale", (0.05, 0.12), "of the voltage", "psi_Wb", lambda m, x, d: x * m.psi_Wb),
    Fault("L_q less", (0.1, 0.25), "of L_q", "Lq_H", lambda m, x, d: x * m.Lq_H,
          joined=lambda m, x, d: {"machine.Lq_H": (1 - x) * m.Lq_H}, expected="unknown"),
    Fault("over_temperature", (HEATING_K_S,), "K/s", "temperature_K", lambda m, x, d: LIMIT_K + 15,
          lambda m, x: {"nonideal.heat_W": 1e4 * x},
          lambda m, x: {"nonideal.winding_alpha_per_K": 0.0039, "machine.winding_heat_J_K": 1e4,
                        "machine.magnet_heat_J_K": 1e9}, after_s=(LIMIT_K + 15) / HEATING_K_S),
)


@dataclasses.dataclass(frozen=True)
class Case:
    kind: int  # in FAULTS, whose functions go to no other process
    severity: float
    drive: Drive  # healthy
    number: int

    @property
    def fault(self) -> Fault:
        return FAULTS[self.kind]


def cases(seed: int, per: int) -> list[Case]:
    chosen = []
    for kind, fault in enumerate(FAULTS):
        for severity in fault.severities:
            for k in range(2 * (per if fault.after_s == AFTER_S else max(1, per // 5))):
                observed = k % 2 == 1
                if observed and fault.name == "encoder_offset":
                    continue
                r = random.Random(f"faults {seed} {fault.name} {severity} {k}")
                names = [n for n in IMPERFECTIONS if n not in LEFT_OUT and not (observed and n in OF_ENCODER)
                         and not ("dead time" in n and fault.name == "inverter_fault")]
                picked = ["dead time", *(["observer"] if observed else []), *r.sample(names, r.randint(0, 1))]
                until_s = START_S + GROWS_S + fault.after_s
                # The fast machine costs most: not for minutes.
                machine = MACHINES[k // 2 % (4 if fault.after_s == AFTER_S else 3)]
                drive = drawn(r, machine, tuple(picked), (until_s, until_s))
                chosen.append(Case(kind, severity, drive.with_settings(duration_s=until_s), len(chosen)))
    # What was found is read in any order, and a run that is stopped has some of each.
    return random.Random(seed).sample(chosen, len(chosen))


def set_in(drive: Drive, settings: Settings) -> Drive:
    return drive.with_settings(**{key.replace(".", "__"): value for key, value in settings.items()})


def scaled(csv: pathlib.Path, from_s: float, factor: float) -> None:
    """The voltage measured with another gain."""
    with csv.open() as source, csv.with_suffix(".new").open("w") as target:
        names = source.readline()
        target.write(names)
        at = [k for k, name in enumerate(names.strip().split(",")) if name in ("v_d_V", "v_q_V", "v_dc_V")]
        for line in source:
            if float(line.split(",", 1)[0]) >= from_s:
                cells = line.split(",")
                for k in at:
                    cells[k] = f"{factor * float(cells[k]):.9g}"
                line = ",".join(cells)
            target.write(line)
    csv.with_suffix(".new").replace(csv)


def join(first: pathlib.Path, second: pathlib.Path) -> None:
    """The second's rows from where the fault has grown; the rows between are missing."""
    with second.open() as source, first.open("a") as target:
        source.readline()
        target.writelines(line for line in source if float(line.split(",", 1)[0]) >= START_S + GROWS_S)


def simulated(tools: Tools, case: Case, folder: pathlib.Path) -> tuple[command.Simulated, list[str]]:
    """The log, and the commands that make it."""
    fault, m = case.fault, case.drive.machine
    drive = set_in(case.drive, fault.also(m, case.severity))
    if fault.joined:
        sim = command.simulate(tools, drive.with_settings(duration_s=START_S), folder)
        after = set_in(drive, fault.joined(m, case.severity, drive))
        join(sim.csv, command.simulate(tools, after, folder / "after").csv)
        return sim, [command.repeat(drive), command.repeat(after)]
    if fault.ramp:
        for key, value in fault.ramp(m, case.severity).items():
            drive = set_in(drive, {key: value, f"{key}.t_start_s": START_S, f"{key}.t_end_s": START_S + GROWS_S})
    sim = command.simulate(tools, drive, folder)
    if not fault.ramp:
        sign = random.Random(case.drive.seed).choice((-1, 1))
        scaled(sim.csv, START_S, 1 + sign * case.severity)
    return sim, [command.repeat(drive)]


def one(job: tuple[Tools, Case]) -> list[dict]:
    tools, case = job
    fault, drive = case.fault, case.drive
    found = []
    with tempfile.TemporaryDirectory() as folder:
        sim, commands = simulated(tools, case, pathlib.Path(folder))
        command.tell(sim, True)
        # Heat is a fault when the limit is passed; an event may be earlier, as the monitor knows it within some kelvin.
        at_s = START_S if fault.name != "over_temperature" else START_S + LIMIT_K / HEATING_K_S
        change = fault.change(drive.machine, case.severity, drive)
        for arith, choice in (("float", ()), ("q15", ("--q15",))):
            said = tools.json("bench/campaign_reads", str(sim.csv), "--until", str(START_S), *choice)
            least = said[fault.channel]["sensitivity"]
            events = command.events(tools, sim.csv, arith)
            found.append(command.about(drive) | {
                "number": case.number, "fault": fault.name, "right": fault.right, "severity": case.severity,
                "arith": arith, "why": said["why"], "change": change, "sensitivity": least,
                "above": least is not None and change > least, "watched": said["why"] == "in service", "at_s": at_s,
                "repeat": commands, "before": [e for e in events if e["t_s"] < START_S],
                "first": next((e for e in events if e["t_s"] >= START_S), None)})
    return found


def outcome(run: dict) -> str:
    if run["first"] is None:
        return "silent"
    name = run["first"]["fault"]
    return "right" if name == run["right"] else "unknown" if name == "unknown" else "wrong"


def fault_rows(runs: list[dict]) -> list[list[object]]:
    rows = []
    for fault in FAULTS:
        for severity in fault.severities:
            part = [r for r in runs if r["fault"] == fault.name and r["severity"] == severity]
            if not part:
                continue
            above = [r for r in part if r["above"]]
            o, all_of = Counter(map(outcome, above)), Counter(map(outcome, part))
            delays = [r["first"]["t_s"] - r["at_s"] for r in part if r["first"]]
            late = f"{figures.mean(delays):.2f}, {max(delays):.2f}" if delays else "–"
            rows.append([f"{fault.name}, {severity:g} {fault.of}", len(part), sum(r["watched"] for r in part),
                         len(above), *(f"{o[x]} ({all_of[x]})" for x in ("right", "unknown", "wrong", "silent")), late,
                         sum(len(r["before"]) for r in part)])
    return rows


def calibration(runs: list[dict]) -> None:
    told = [(r["first"]["confidence"], outcome(r) == "right") for r in runs if r["first"]]
    rows = []
    edges = (0, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0001)
    for low, high in zip(edges, edges[1:]):
        part = [(c, right) for c, right in told if low <= c < high]
        if not part:
            continue
        hits, stated = sum(right for _, right in part), figures.mean(c for c, _ in part)
        interval = figures.wilson(hits, len(part))
        verdict = "holds" if interval[0] <= stated <= interval[1] else "does not"
        rows.append([f"{low:g} to {min(high, 1):g}", len(part), figures.percent(stated),
                     figures.share(hits, len(part)), verdict if len(part) >= BIN_LEAST else "too few"])
    print("Confidence, of the first event after each fault:\n")
    figures.table(("confidence", "cases", "mean stated, %", "right, %", ""), rows)
    score = figures.mean((c - right) ** 2 for c, right in told)
    of_all = figures.mean(right for _, right in told)
    print(f"Brier score {score:.3f}, where the share right alone would have {of_all * (1 - of_all):.3f}.\n")


def report(runs: list[dict]) -> None:
    print("## Faults\n\nDrives that switch, with dead time and at most one imperfection more, every second with an "
          f"observer; healthy for\n{START_S:g} s, then the fault within {GROWS_S:g} s, {AFTER_S:g} s more. Above: the "
          "change is larger than the sensitivity that\nthis monitor stated just before. Of those: right (wanted "
          "95 %), unknown, wrong (1 %), silent; in brackets of all. Delay of\nthe first event, mean and worst, s. "
          "Before: events before the fault, all of them false.\n")
    names = sorted({fault.right for fault in FAULTS} | {r["first"]["fault"] for r in runs if r["first"]})
    for arith in ("float", "q15"):
        part = [r for r in runs if r["arith"] == arith]
        above = [r for r in part if r["above"]]
        o = Counter(map(outcome, above))
        print(f"### {arith}\n")
        head = ("fault", "drives", "watched", "above", "right", "unknown", "wrong", "silent", "delay", "before")
        figures.table(head, fault_rows(part))
        print(f"Of {len(above)} above: right {figures.share(o['right'], len(above))} %, wrong "
              f"{figures.share(o['wrong'], len(above))} %, unknown {o['unknown']}, silent {o['silent']}. Before a "
              f"fault: {sum(len(r['before']) for r in part)} events in {START_S * len(part):.3g} s on "
              f"{sum(bool(r['before']) for r in part)} drives. Confusion, of all drives:\n")
        rows = []
        for fault in FAULTS:
            of = [r for r in part if r["fault"] == fault.name]
            said = Counter(r["first"]["fault"] if r["first"] else "" for r in of)
            if of:
                rows.append([fault.name, *(said[name] or "·" for name in names), said[""] or "·"])
        figures.table(("fault", *names, "silent"), rows)
        calibration(part)
    wrong = [r for r in runs if outcome(r) == "wrong" or (r["above"] and outcome(r) == "silent")]
    print("Named wrongly, or silent above the sensitivity:\n")
    figures.table(("drive", "fault", "arithmetic", "change / sensitivity", "said", "confidence"), [
        [command.where(r), f"{r['fault']} {r['severity']:g}", r["arith"],
         f"{r['change'] / r['sensitivity']:.2g}" if r["sensitivity"] and not math.isinf(r["sensitivity"]) else "–",
         *((r["first"]["fault"], r["first"]["confidence"]) if r["first"] else ("–", "–"))] for r in wrong])
