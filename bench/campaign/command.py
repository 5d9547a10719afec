"""The command as a user has it: simulate into a folder, tell what is known of the log, read what it says."""

from __future__ import annotations

import dataclasses
import json
import pathlib
import random
import re
import shlex
import subprocess

from .drives import Drive

PARAMETERS = ("R_ohm", "Ld_H", "Lq_H", "psi_Wb")


@dataclasses.dataclass(frozen=True)
class Tools:
    build: pathlib.Path

    def run(self, program: str, *arguments: str) -> tuple[str, str]:
        done = subprocess.run([self.build / program, *arguments], capture_output=True, text=True)
        # 4: a parameter is not identifiable; it is absent.
        if done.returncode not in (0, 4):
            raise RuntimeError(f"{program} {arguments[0]}: {done.stderr.strip()[-300:]}")
        return done.stdout, done.stderr

    def json(self, program: str, *arguments: str) -> dict:
        return json.loads(self.run(program, *arguments)[0])


@dataclasses.dataclass(frozen=True)
class Simulated:
    drive: Drive
    csv: pathlib.Path
    truth: dict[str, float]
    end: dict[str, float]  # last row


def simulate(tools: Tools, drive: Drive, folder: pathlib.Path) -> Simulated:
    """Truth as it is at the log's end and as the drive's sensors have it, R from the inverter's rails on."""
    said = tools.json("dqwatch", *drive.arguments(), "--out", str(folder), "--json")
    csv = pathlib.Path(said["csv"])
    csv.with_suffix(".toml").unlink()  # it holds the truth
    with csv.open("rb") as file:
        names = file.readline().decode().strip().split(",")
        file.seek(-1000, 2)
        end = dict(zip(names, map(float, file.read().decode().strip().rsplit("\n", 1)[1].split(","))))
    truth = {name: said["truth"][name] for name in PARAMETERS}
    plain = drive.value("nonideal.winding_alpha_per_K") == "0"
    if not plain:
        truth["R_ohm"] *= 1 + 0.0039 * (end["temp_winding_C"] - 25)
        truth["psi_Wb"] *= 1 + drive.machine.magnet_beta * (end["temp_magnet_C"] - 25)
    truth["R_ohm"] += drive.legs_ohm
    for name in ("R_ohm", "Ld_H", "Lq_H"):
        truth[name] /= drive.common_gain
    return Simulated(drive, csv, truth, end)


def modulation_of(drive: Drive) -> str:
    return drive.value("inverter.modulation")


def tell(sim: Simulated, told: bool) -> None:
    """The machine file: pole pairs and kind of angle; told: also the modulation, J, and a nameplate up to 15 % off."""
    drive, m = sim.drive, sim.drive.machine
    lines = ["[log]", 'regime = "dynamic"', 'voltage_interval = "next"',
             f'angle = "{"observer" if drive.observed else "encoder"}"']
    if told:
        lines.append(f'modulation = "{modulation_of(drive)}"')
    lines += ["[machine]", f"pole_pairs = {m.pole_pairs}"]
    if told:
        r = random.Random(drive.seed)
        lines.append(f"J_kgm2 = {m.J_kgm2}")
        lines += [f"{name} = {getattr(m, name) * r.uniform(0.85, 1.15):.4g}" for name in PARAMETERS]
    sim.csv.with_suffix(".toml").write_text("\n".join(lines) + "\n")


def voltage_later(csv: pathlib.Path, rows: int = 1) -> None:
    """What a user does who logs the voltage as decided: it acts one row later."""
    kept: list[list[str]] = []
    with csv.open() as source, csv.with_suffix(".new").open("w") as target:
        names = source.readline()
        target.write(names)
        at = [names.strip().split(",").index(name) for name in ("v_d_V", "v_q_V")]
        for line in source:
            cells = line.split(",")
            kept.append([cells[k] for k in at])
            if len(kept) <= rows:
                continue
            for k, cell in zip(at, kept.pop(0)):
                cells[k] = cell
            target.write(",".join(cells))
    csv.with_suffix(".new").replace(csv)


def events(tools: Tools, csv: pathlib.Path, arith: str) -> list[dict]:
    lines, _ = tools.run("dqwatch", "monitor", str(csv), "--json", "--arith", arith, "--out", str(csv.parent))
    said = map(json.loads, lines.splitlines())
    return [line for line in said if line["schema"] == "dqwatch.event/1"]


def service(tools: Tools, csv: pathlib.Path, arith: str) -> tuple[float | None, str]:
    """When it came into service first, and what the command says where it did not."""
    out, notes = tools.run("dqwatch", "monitor", str(csv), "--arith", arith, "--out", str(csv.parent))
    found = re.search(r"first in service at ([\d.]+) s", out) or re.search(r"in service since ([\d.]+) s", out)
    said = re.search(r"not in service: (.*)", notes)
    return (float(found[1]) if found else None), (said[1] if said else "")


def read(value: float | None, sd: float | None) -> dict | None:
    if value is None or sd is None:
        return None
    return {"value": value, "sd": sd, "usable": value > 0 and 3 * sd < 0.1 * value}


def monitor_reads(tools: Tools, csv: pathlib.Path, arith: str) -> dict[str, dict | None]:
    said = tools.json("bench/campaign_reads", str(csv), *(["--q15"] if arith == "q15" else []))
    return {p: None if said[p]["sd"] is None else said[p] for p in PARAMETERS} | {"modulation": said["modulation"]}


def learn_reads(tools: Tools, csv: pathlib.Path, arith: str, *more: str) -> dict[str, dict | None]:
    said = tools.json("dqwatch", "learn", str(csv), "--json", "--arith", arith, *more)["parameters"]
    return {p: read(said[p]["value"], said[p].get("sd")) if p in said else None for p in PARAMETERS}


def plain_reads(tools: Tools, csv: pathlib.Path, pole_pairs: int) -> dict[str, dict | None]:
    said = tools.json("bench/plain_blocks", str(csv), str(pole_pairs))
    return {p: read(said[p]["value"], said[p]["sd"]) if p in said else None for p in PARAMETERS}


def about(drive: Drive) -> dict:
    return {"title": drive.title, "machine": drive.machine.name, "modulation": modulation_of(drive),
            "observed": drive.observed, "looped": drive.looped}


def where(run: dict) -> str:
    speed = ", speed loop" if run.get("looped") else ""
    return f"{run['number']} {run['machine']}, {run['modulation']}{speed}: {run['title']}"


def repeat(drive: Drive) -> str:
    return "dqwatch " + shlex.join(drive.arguments())
