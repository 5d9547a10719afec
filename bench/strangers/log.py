"""A foreign drive's rows as the log that its user would write, with the truth beside it."""

from __future__ import annotations

import dataclasses
import json
import math
import pathlib

import numpy as np

from .draw import Spec
from .drive import Rows, known_link, vector_of, phases

DRIVEN_BY_USER = ("clip", "held", "hum", "filtered", "turned", "swapped", "rows_apart")


@dataclasses.dataclass
class Table:
    """Columns of a log, SI."""

    t: np.ndarray
    v: np.ndarray
    i: np.ndarray
    w_m: np.ndarray
    theta: np.ndarray


def table_of(spec: Spec, rows: Rows, exact: bool) -> Table:
    """Currents in the frame of the angle seen; the voltage's mean over the period as seen in the rotating frame."""
    T, p = float(spec.drive["T"]), spec.machine["p"]
    theta = (rows.theta_exact if exact else rows.theta).copy()
    w_e = p * (rows.w_exact if exact else rows.w_m)
    i = rows.i_exact if exact else rows.i
    if "half_step" in spec.effects:
        theta += 0.5 * T * w_e
    half = 0.5 * T * w_e
    v = rows.u * np.exp(-1j * (theta + half)) * np.sinc(half / math.pi)
    if "late_reference" in spec.effects:
        v = rows.u_dq
    return Table(rows.t, v, i * np.exp(-1j * theta), rows.w_exact if exact else rows.w_m, theta)


def spoil(spec: Spec, log: Table, random: np.random.Generator) -> Table:
    """What the sensors and the record do that no effect of the catalogue is."""
    i, v = log.i.copy(), log.v.copy()
    frame = np.exp(1j * log.theta)
    if clip := spec.outside.get("clip"):
        most = float(clip["ampere"])
        ends = np.array([np.clip(phases(complex(x)), -most, most) for x in i * frame])
        i = np.array([vector_of((a, b, c)) for a, b, c in ends]) / frame
    if hum := spec.outside.get("hum"):
        wave = 2 / 3 * float(hum["ampere"]) * np.sin(2 * math.pi * float(hum["Hz"]) * log.t + 1.0)
        i = i + wave / frame
    if held := spec.outside.get("held"):
        for k in np.flatnonzero(random.random(len(i)) < float(held["fraction"])):
            if k:
                i[k] = i[k - 1]
    if filtered := spec.outside.get("filtered"):
        n = int(filtered["rows"])
        padded = np.concatenate([np.full(n - 1, i[0]), i])
        i = np.convolve(padded, np.full(n, 1 / n), "valid")
    if apart := spec.outside.get("rows_apart"):
        v = np.roll(v, int(apart["rows"]))
    if "turned" in spec.outside:
        v = -v.real + 1j * v.imag
    if "swapped" in spec.outside:
        i = i.imag + 1j * i.real
    return Table(log.t, v, i, log.w_m, log.theta)


def blocks(spec: Spec, log: Table) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and voltage of both axes, averaged over max(20 rows, 1 ms), the currents' change from the ends."""
    T, p = float(spec.drive["T"]), spec.machine["p"]
    n = max(20, round(1e-3 / T))
    count = (len(log.t) - 1) // n
    w = p * log.w_m

    def mean(x: np.ndarray) -> np.ndarray:
        between = 0.5 * (x[:-1] + x[1:])
        return between[:count * n].reshape(count, n).mean(axis=1)

    # Between two samples the currents bow, since the rotor turns below the vector held: from the trapezoid, the mean of
    # v(s) / L, twice integrated, is j w v T^2 / 12 L away.
    held = 1j * w[:-1] * log.v[:-1] * T**2 / 12
    bow = held.real / spec.machine["Ld"] + 1j * held.imag / spec.machine["Lq"]

    def bowed(x: np.ndarray, by: np.ndarray) -> np.ndarray:
        between = 0.5 * (x[:-1] + x[1:]) + by
        return between[:count * n].reshape(count, n).mean(axis=1)

    change = (log.i[n::n][:count] - log.i[:-1:n][:count]) / (n * T)
    v = log.v[:count * n].reshape(count, n).mean(axis=1)
    i, wi, w_mean, none = bowed(log.i, bow), bowed(w * log.i, w[:-1] * bow), mean(w), np.zeros(count)
    d = np.column_stack([i.real, change.real, -wi.imag, none])
    q = np.column_stack([i.imag, wi.real, change.imag, w_mean])
    return np.vstack([d, q]), np.concatenate([v.real, v.imag])


@dataclasses.dataclass
class Seen:
    """How much of what is wrong shows, and the plain model's best parameters without noise."""

    strength: float
    floor_V: float
    plain: list[float]


def seen_of(spec: Spec, exact: Table, noisy: Table) -> Seen:
    x, y = blocks(spec, exact)
    scale = np.linalg.norm(x, axis=0)
    best = np.linalg.lstsq(x / scale, y, rcond=None)[0] / scale
    rest = y - x @ best
    m = spec.machine
    true = np.array([m["R"], m["Ld"], m["Lq"], m["psi"]])
    x_noisy, y_noisy = blocks(spec, noisy)
    noise = (y_noisy - y) - (x_noisy - x) @ true
    floor = float(np.sqrt(np.mean(noise**2)))
    return Seen(float(np.hypot(np.sqrt(np.mean(rest**2)), floor) / floor), floor, [float(b) for b in best])


def truth_of(spec: Spec, rows: Rows, incremental: list[tuple[float, float]] | None) -> dict[str, list[float]]:
    """Value at the log's start and at rest, then least and most of what the parameter was."""
    m = spec.machine
    unlike = spec.effects.get("phase_resistance_imbalance", {})
    more = [0.0, *(float(x) for x in unlike.values())]
    Ld, Lq = [m["Ld"]], [m["Lq"]]
    if incremental:
        Ld += [d for d, _ in incremental]
        Lq += [q for _, q in incremental]
    return {"R_ohm": [m["R"], float(rows.R.min()) + min(more), float(rows.R.max()) + max(more)],
            "Ld_H": [m["Ld"], min(Ld), max(Ld)], "Lq_H": [m["Lq"], min(Lq), max(Lq)],
            "psi_Wb": [m["psi"], float(rows.psi.min()), float(rows.psi.max())]}


def write(spec: Spec, rows: Rows, incremental: list[tuple[float, float]] | None, random: np.random.Generator,
          stem: pathlib.Path) -> None:
    exact, noisy = table_of(spec, rows, True), table_of(spec, rows, False)
    v_noise = spec.noise["v"] * float(spec.drive["v_dc"]) / math.sqrt(3)
    noisy.v = noisy.v + random.normal(0, v_noise, len(noisy.v)) + 1j * random.normal(0, v_noise, len(noisy.v))
    if spec.outside.keys() & set(DRIVEN_BY_USER):
        # One generator state for both: the same rows are held.
        state = random.bit_generator.state
        exact = spoil(spec, exact, random)
        random.bit_generator.state = state
        noisy = spoil(spec, noisy, random)
    seen = seen_of(spec, exact, noisy)
    previous = spec.log["interval"] == "previous"
    v = np.roll(noisy.v, 1) if previous else noisy.v
    start = 1 if previous else 0
    columns = {"t_s": noisy.t, "v_d_V": v.real, "v_q_V": v.imag, "i_d_A": noisy.i.real, "i_q_A": noisy.i.imag,
               "w_m_rad_s": noisy.w_m}
    if spec.log["theta"]:
        columns["theta_e_rad"] = np.angle(np.exp(1j * noisy.theta))
        columns["theta_m_rad"] = np.angle(np.exp(1j * noisy.theta / spec.machine["p"]))
    if spec.log["v_dc"]:
        columns["v_dc_V"] = np.full(len(noisy.t), known_link(spec))
    if spec.log["temperature"] and "winding_temperature" in spec.effects:
        columns["temp_winding_C"] = 25 + (rows.R / spec.machine["R"] - 1) / 0.0039
    if spec.log["temperature"] and "magnet_temperature" in spec.effects:
        columns["temp_magnet_C"] = 25 + (1 - rows.psi / spec.machine["psi"]) / 0.0012
    lines = [",".join(columns)]
    table = np.column_stack(list(columns.values()))[start:]
    lines += [",".join(f"{x:.9g}" for x in row) for row in table]
    stem.with_suffix(".csv").write_text("\n".join(lines) + "\n")
    said = ["[log]", 'regime = "dynamic"', f'voltage_interval = "{spec.log["interval"]}"', "[machine]"]
    if spec.log["pole_pairs"]:
        said.append(f"pole_pairs = {int(spec.machine['p'])}")
    if spec.log["nameplate"]:
        for key, name in (("R", "R_ohm"), ("Ld", "Ld_H"), ("Lq", "Lq_H"), ("psi", "psi_Wb")):
            said.append(f"{name} = {spec.machine[key] * random.uniform(0.75, 1.25):.4g}")
    stem.with_suffix(".toml").write_text("\n".join(said) + "\n")
    truth = {"spec": dataclasses.asdict(spec), "truth": [list(names) for names in spec.truth],
             "parameters": truth_of(spec, rows, incremental), "strength": seen.strength, "floor_V": seen.floor_V,
             "plain": seen.plain}
    stem.with_suffix(".truth.json").write_text(json.dumps(truth, indent=1) + "\n")
