"""What a seed draws: a machine, a drive of one of two foreign simulators, and an effect, two, none, or something
outside the catalogue."""

from __future__ import annotations

import dataclasses
import math
import random

# Machines of data sheets and papers that no other draw of this project starts from: pole pairs, ohm, henry, henry,
# weber, ampere, volt, radian a second, kilogram square metre.
PLATES = {
    "pmsm 2.2 kW": (3, 3.6, 36e-3, 51e-3, 0.545, 6.1, 540, 157, 15e-3),
    "pmsyrm 5.6 kW": (2, 0.63, 18e-3, 110e-3, 0.47, 12, 540, 180, 30e-3),
    "ev 70 kW": (3, 0.018, 0.37e-3, 1.2e-3, 0.066, 240, 350, 420, 39e-3),
    "servo 48 V": (4, 0.18, 0.42e-3, 0.55e-3, 0.0165, 12, 48, 250, 2e-4),
    "drill 18 V": (2, 0.035, 28e-6, 36e-6, 0.0042, 40, 20, 900, 3e-5),
    "gimbal": (7, 2.3, 0.9e-3, 0.9e-3, 0.011, 2.5, 24, 90, 6e-5),
    "spindle 20 kW": (2, 0.11, 0.9e-3, 1.1e-3, 0.12, 60, 560, 700, 8e-3),
    "wheel hub": (15, 0.24, 520e-6, 650e-6, 0.0245, 20, 48, 45, 6e-3),
}

# Names as dqwatch has them. Several that one cause is rightly called by stand together: the first one is meant.
SAME = {"late_reference": ("delay", "sample_shift"), "half_step": ("sample_shift", "delay")}

EFFECTS = {
    "motulator": ("dead_time", "dead_time", "dead_time", "delay", "late_reference", "angle_offset", "saturation",
                  "saturation_cross", "winding_temperature", "winding_temperature", "magnet_temperature", "iron_loss",
                  "current_offset", "current_gain_mismatch", "phase_resistance_imbalance", "sample_shift",
                  "sensor_lag", "voltage_scale", "encoder_eccentricity", "turn_short", "magnet_asymmetry"),
    "gem": ("dead_time", "dead_time", "delay", "late_reference", "angle_offset", "winding_temperature",
            "current_offset", "current_gain_mismatch", "sample_shift", "half_step", "voltage_scale",
            "encoder_eccentricity"),
}
OUTSIDE = {
    "motulator": ("clip", "held", "hum", "overmodulation", "filtered", "turned", "swapped", "rows_apart", "link_ripple",
                  "disturbance"),
    "gem": ("clip", "held", "hum", "overmodulation", "filtered", "turned", "swapped", "rows_apart", "disturbance"),
}
# What would hide each other or is two already.
ALONE = {"saturation_cross", "late_reference", "half_step", "winding_temperature", "magnet_temperature", "sample_shift",
         "sensor_lag", "turn_short", "voltage_scale"}


@dataclasses.dataclass
class Spec:
    """All that a run needs; JSON between the environments."""

    seed: int
    simulator: str
    kind: str  # clean, one, two, outside
    plate: str
    machine: dict[str, float]  # p, R, Ld, Lq, psi, J
    drive: dict[str, float | bool | str]
    noise: dict[str, float]
    log: dict[str, bool | str]
    effects: dict[str, dict[str, float | str]]
    outside: dict[str, dict[str, float | str]]

    @property
    def truth(self) -> list[tuple[str, ...]]:
        """Each a name, or several that are right."""
        names: list[tuple[str, ...]] = []
        for name in self.effects:
            if name == "saturation_cross":
                names += [("saturation",), ("cross_saturation",)]
            else:
                names.append(SAME.get(name, (name,)))
        return names


def log_uniform(r: random.Random, low: float, high: float) -> float:
    return low * (high / low) ** r.random()


def either(r: random.Random, low: float, high: float) -> float:
    return r.choice((-1, 1)) * r.uniform(low, high)


def draw_machine(r: random.Random) -> tuple[str, dict[str, float], dict[str, float | bool | str]]:
    plate = r.choice(sorted(PLATES))
    p, R, Ld, Lq, psi, amp, v_dc, speed, J = PLATES[plate]
    L = log_uniform(r, 0.7, 1.4)
    machine = {"p": float(p), "R": R * log_uniform(r, 0.6, 1.6), "Ld": Ld * L, "Lq": Lq * L * r.uniform(0.95, 1.25),
               "psi": psi * log_uniform(r, 0.8, 1.2), "J": J}
    v_max = v_dc / math.sqrt(3)
    amp = min(amp * log_uniform(r, 0.6, 1.1), 0.25 * v_max / machine["R"])
    # The machine's EMF takes up to 0.55 of the voltage, L i no more than 0.35.
    w_e = min(r.uniform(0.3, 0.55) * v_max / machine["psi"], 0.35 * v_max / (machine["Lq"] * amp), 1.4 * p * speed)
    # Seven samples in L/R and 21 in a turn; no drive samples faster than 40 kHz.
    slowest = min(0.15 * min(machine["Ld"], machine["Lq"]) / machine["R"], 0.3 / w_e)
    T = r.choice([t for t in (25e-6, 31.25e-6, 50e-6, 62.5e-6, 1e-4, 1.25e-4, 2e-4, 2.5e-4) if t <= slowest] or [25e-6])
    w_e = min(w_e, 0.3 / T)
    rows = r.randrange(10000, 16000)
    injects = r.random() < 0.6
    drive: dict[str, float | bool | str] = {
        "T": T, "rows": rows, "v_dc": float(v_dc), "amp": amp, "w_m": w_e / p,
        "bandwidth": min(0.12 / T, 2 * math.pi * 500) * r.uniform(0.5, 1), "free": r.random() < 0.5,
        "hold_s": max(log_uniform(r, 30, 200) * T, 4 * T / 0.12), "shape": r.choice(("sine", "stairs", "triangle")),
        "turns": r.uniform(2, 6), "one_way": r.random() < 0.25, "inject": r.uniform(0.03, 0.1) if injects else 0.0,
        "pwm": r.random() < 0.15}
    # The shaft follows a third of the torque through the profile.
    span = rows * T / (4 * float(drive["turns"]))
    machine["J"] = min(max(0.5 * p * psi * amp * span / (w_e / p), 0.2 * J), 20 * J)
    return plate, machine, drive


def draw_noise(r: random.Random) -> dict[str, float]:
    """Of the currents' size, the voltage, the speed, and of a quantum; angle in radian."""
    level = log_uniform(r, 0.0005, 0.015)
    return {"i": level, "v": level * r.choice((0, 0, 0.2)), "w": level * r.choice((0.05, 0.2, 0.5)),
            "theta": r.choice((0.0, 2e-4, 1e-3)), "bits": float(r.choice((0, 0, 12, 14)))}


def size_of(r: random.Random, name: str, machine: dict[str, float],
            drive: dict[str, float | bool | str]) -> dict[str, float | str]:
    """Sizes as drives and data sheets have them."""
    amp, T, v_dc = float(drive["amp"]), float(drive["T"]), float(drive["v_dc"])
    w_e = machine["p"] * float(drive["w_m"])
    if name == "dead_time":
        # Of a link: 0.3 to 2 % of the period; a part given back too much by one in five.
        sign = -1 if r.random() < 0.2 else 1
        return {"volt": sign * v_dc * log_uniform(r, 0.004, 0.02), "width": amp * log_uniform(r, 0.005, 0.06),
                "law": r.choice(("arctan", "ramp", "tanh", "plateau"))}
    if name == "delay":
        return {"periods": r.uniform(0.3, 1.0)}
    if name == "angle_offset":
        return {"rad": either(r, 0.02, 0.15)}
    if name in ("saturation", "saturation_cross"):
        return {"d": r.uniform(0.03, 0.15), "q": r.uniform(0.1, 0.5), "power": float(r.choice((2, 4))),
                "cross": r.uniform(0.1, 0.4) if name == "saturation_cross" else 0.0}
    if name == "winding_temperature":
        # A copper's rise by itself, or by a neighbour: not of i^2, but towards an end.
        return {"rise": r.uniform(0.1, 0.35), "driven": r.choice(("loss", "time")), "tau": r.uniform(0.3, 1.5)}
    if name == "magnet_temperature":
        return {"fall": r.uniform(0.02, 0.08), "tau": r.uniform(0.3, 1.5)}
    if name == "iron_loss":
        return {"ohm": w_e * machine["psi"] / (amp * r.uniform(0.03, 0.15))}
    if name == "current_offset":
        return {"alpha": amp * either(r, 0.01, 0.05), "beta": amp * either(r, 0.01, 0.05)}
    if name == "current_gain_mismatch":
        return {"a": (size := r.uniform(0.02, 0.08)) * math.cos(x := r.uniform(0, 6.28)),
                "b": size * math.cos(x - 2.0944), "c": size * math.cos(x + 2.0944)}
    if name == "phase_resistance_imbalance":
        return {"a": machine["R"] * either(r, 0.05, 0.3), "b": machine["R"] * either(r, 0.0, 0.2)}
    if name == "sample_shift":
        return {"periods": r.uniform(0.05, 0.5)}
    if name == "sensor_lag":
        return {"tau": T * r.uniform(0.2, 1.5)}
    if name == "voltage_scale":
        # A twentieth to a fifth of the link at the largest power.
        return {"ohm": r.uniform(0.05, 0.2) * v_dc / (amp * 1.2), "farad_s": T * r.uniform(4, 20)}
    if name == "encoder_eccentricity":
        return {"rad": machine["p"] * r.uniform(0.005, 0.03) / max(1, machine["p"] / 4),
                "order": float(r.choice((1, 2))), "phase": r.uniform(0, 6.28)}
    if name == "turn_short":
        return {"ohm": w_e * machine["psi"] / (amp * r.uniform(0.03, 0.15))}
    if name == "magnet_asymmetry":
        return {"weber": machine["psi"] * r.uniform(0.01, 0.05), "phase": r.uniform(0, 6.28)}
    return {}


def outside_of(r: random.Random, name: str, drive: dict[str, float | bool | str]) -> dict[str, float | str]:
    amp, v_dc = float(drive["amp"]), float(drive["v_dc"])
    if name == "clip":
        return {"ampere": amp * r.uniform(0.35, 0.6)}
    if name == "held":
        return {"fraction": r.uniform(0.1, 0.4)}
    if name == "hum":
        return {"ampere": amp * r.uniform(0.04, 0.15), "Hz": r.choice((50.0, 60.0))}
    if name == "overmodulation":
        return {"link": r.uniform(0.35, 0.6)}
    if name == "filtered":
        return {"rows": float(r.choice((3, 5, 9)))}
    if name == "rows_apart":
        return {"rows": float(r.choice((-3, -2, 2, 3)))}
    if name == "link_ripple":
        return {"part": r.uniform(0.04, 0.12), "Hz": r.choice((100.0, 300.0))}
    if name == "disturbance":
        return {"volt": v_dc * r.uniform(0.01, 0.05), "Hz": r.uniform(20, 80)}
    return {}


def sees(spec_log: dict[str, bool | str], name: str) -> bool:
    """What goes with the mechanical angle needs it in the log."""
    return name not in ("encoder_eccentricity", "magnet_asymmetry") or bool(spec_log["theta"])


def draw(seed: int) -> Spec:
    """Of ten seeds in a row two are clean, five have an effect, one two, two something outside."""
    r = random.Random(f"stranger {seed}")
    kind = ("clean", "one", "one", "outside", "one", "two", "one", "clean", "one", "outside")[seed % 10]
    simulator = r.choice(("motulator", "motulator", "gem"))
    plate, machine, drive = draw_machine(r)
    log: dict[str, bool | str] = {
        "theta": r.random() < 0.6, "pole_pairs": r.random() < 0.8, "nameplate": r.random() < 0.4,
        "v_dc": r.random() < 0.4, "temperature": r.random() < 0.4,
        "interval": "previous" if r.random() < 0.15 else "next"}
    effects: dict[str, dict[str, float | str]] = {}
    outside: dict[str, dict[str, float | str]] = {}
    if kind == "outside":
        name = r.choice(OUTSIDE[simulator])
        outside[name] = outside_of(r, name, drive)
    wanted = {"clean": 0, "one": 1, "two": 2, "outside": 0}[kind]
    while len(effects) < wanted:
        name = r.choice(EFFECTS[simulator])
        if effects and (ALONE & {name, *effects} or name in effects):
            continue
        if wanted == 2 and name in ALONE:
            continue
        if not sees(log, name):
            log["theta"] = True
        if name == "delay":
            drive["inject"] = drive["inject"] or 0.06
        effects[name] = size_of(r, name, machine, drive)
    if "voltage_scale" in effects or "overmodulation" in outside or "link_ripple" in outside:
        log["v_dc"] = False
    return Spec(seed, simulator, kind, plate, machine, drive, draw_noise(r), log, effects, outside)
