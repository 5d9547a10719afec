"""A drive around a foreign plant: profile, sensors, one period of delay, and what is kept of each period."""

from __future__ import annotations

import dataclasses
import math
from typing import Protocol

import numpy as np

from .draw import Spec

TURN = 2 * math.pi
Abc = tuple[float, float, float]


def phases(vector: complex) -> Abc:
    """Amplitude-invariant, no zero sequence."""
    half, root = -0.5 * vector.real, math.sqrt(0.75) * vector.imag
    return vector.real, half + root, half - root


def vector_of(abc: Abc) -> complex:
    a, b, c = abc
    return complex((2 * a - b - c) / 3, (b - c) / math.sqrt(3))


def turned(angle: float) -> complex:
    return complex(math.cos(angle), math.sin(angle))


class Plant(Protocol):
    """Converter, machine and shaft of a foreign simulator."""

    def current(self) -> complex:
        """In the stationary frame."""

    def shaft(self) -> tuple[float, float]:
        """Mechanical angle, not wrapped, and speed."""

    def set_machine(self, R: float, psi: float) -> None:
        """What heat has changed."""

    def set_link(self, volt: float) -> None: ...

    def advance(self, duty: Abc, span_s: float) -> None:
        """Holds the duties, 0 to 1."""

    def torque(self) -> float: ...


class Controller(Protocol):
    def step(self, i_dq: complex, theta: float, w_m: float, v_dc: float, wanted: complex | None,
             speed: float | None) -> tuple[complex, complex, Abc]:
        """Voltage wanted in the frame of theta; the vector meant for the next period, not limited; duties."""


class Profile:
    """Speed, and random stairs of currents; a small square voltage where the drive injects one."""

    def __init__(self, spec: Spec, random: np.random.Generator):
        self.drive, self.random = spec.drive, random
        self.amp, self.T = float(spec.drive["amp"]), float(spec.drive["T"])
        self.free = bool(spec.drive["free"])
        self.every = max(1, round(float(spec.drive["hold_s"]) / self.T))
        self.levels = random.permutation(np.linspace(-1, 1, 6))
        self.i = 0j
        m = spec.machine
        # A tenth of the current in some periods.
        self.kick_V = float(spec.drive["inject"]) * self.amp * min(m["Ld"], m["Lq"]) / (3 * self.T)
        self.kick_rows = int(random.integers(2, 6))
        self.kick = 0j

    def speed(self, t: float) -> float:
        drive = self.drive
        at = (t / (float(drive["rows"]) * self.T)) % 1.0
        if drive["shape"] == "stairs":
            # From step to step within a fifth of one: no load machine jumps.
            step, part = min(int(6 * at), 5), 6 * at % 1.0
            before, share = float(self.levels[max(step - 1, 0)]), float(self.levels[step])
            share = before + (share - before) * min(5 * part, 1.0)
        else:
            wave = math.sin(TURN * at * float(drive["turns"]))
            share = 2 / math.pi * math.asin(wave) if drive["shape"] == "triangle" else wave
        # One way round: from a quarter to the whole of the speed.
        if drive["one_way"]:
            share = 0.625 + 0.375 * share
        return share * float(drive["w_m"])

    def currents(self, k: int) -> complex:
        if k % self.every == 0:
            u = self.random.uniform(-1, 1, 2)
            load = 0.45 if self.free else 0.85
            self.i = self.amp * complex(0.35 * (u[0] - 0.6), load * u[1])
        return self.i

    def injected(self, k: int) -> complex:
        if self.kick_V and k % self.kick_rows == 0:
            u = self.random.integers(0, 2, 2)
            self.kick = self.kick_V * complex(2 * u[0] - 1, 2 * u[1] - 1)
        return self.kick


class Sensors:
    """What the drive takes current, angle and speed for: exactly but for what was drawn, and with noise."""

    def __init__(self, spec: Spec, random: np.random.Generator):
        self.random, self.effects, self.noise = random, spec.effects, spec.noise
        self.p, self.amp, self.w = spec.machine["p"], float(spec.drive["amp"]), float(spec.drive["w_m"])

    def current(self, i: complex) -> tuple[complex, complex]:
        gain, offset = self.effects.get("current_gain_mismatch"), self.effects.get("current_offset")
        a, b, c = phases(i)
        if gain:
            a, b, c = a * (1 + float(gain["a"])), b * (1 + float(gain["b"])), c * (1 + float(gain["c"]))
        if offset:
            o = phases(complex(float(offset["alpha"]), float(offset["beta"])))
            a, b, c = a + o[0], b + o[1], c + o[2]
        n = self.random.normal(0, self.noise["i"] * self.amp, 3)
        seen = [a + n[0], b + n[1], c + n[2]]
        if self.noise["bits"]:
            step = 4 * self.amp / 2 ** self.noise["bits"]
            seen = [step * round(x / step) for x in seen]
        return vector_of((a, b, c)), vector_of((seen[0], seen[1], seen[2]))

    def angle(self, theta_m: float) -> tuple[float, float]:
        theta = self.p * theta_m
        if offset := self.effects.get("angle_offset"):
            theta += float(offset["rad"])
        if wobble := self.effects.get("encoder_eccentricity"):
            theta += float(wobble["rad"]) * math.sin(float(wobble["order"]) * theta_m + float(wobble["phase"]))
        return theta, theta + self.random.normal(0, self.noise["theta"])

    def speed(self, w_m: float) -> float:
        return w_m + self.random.normal(0, self.noise["w"] * self.w)


class Heat:
    """Winding and magnet towards an end; the winding's also as the copper's loss drives it."""

    def __init__(self, spec: Spec):
        self.winding, self.magnet = spec.effects.get("winding_temperature"), spec.effects.get("magnet_temperature")
        self.span = float(spec.drive["rows"]) * float(spec.drive["T"])
        self.loss = 0.15 * float(spec.drive["amp"]) ** 2
        self.R, self.psi, self.rise = spec.machine["R"], spec.machine["psi"], 0.0

    def step(self, i: complex, T: float, at: float) -> tuple[float, float]:
        R, psi = self.R, self.psi
        if self.winding:
            tau = float(self.winding["tau"]) * self.span
            drives = min(abs(i) ** 2 / self.loss, 4.0) if self.winding["driven"] == "loss" else 1.0
            self.rise += T / tau * (float(self.winding["rise"]) / (1 - math.exp(-self.span / tau)) * drives - self.rise)
            R *= 1 + self.rise
        if self.magnet:
            tau = float(self.magnet["tau"]) * self.span
            psi *= 1 - float(self.magnet["fall"]) * (1 - math.exp(-at / tau)) / (1 - math.exp(-self.span / tau))
        return R, psi


@dataclasses.dataclass
class Rows:
    """As the drive knows them, one a period; `exact` is without noise. Stationary frame; theta electrical."""

    t: np.ndarray
    i: np.ndarray
    i_exact: np.ndarray
    theta: np.ndarray
    theta_exact: np.ndarray
    w_m: np.ndarray
    w_exact: np.ndarray
    u: np.ndarray  # the mean voltage of the period, as the drive knows it
    u_dq: np.ndarray  # what the current loops asked for at t, in the frame of t
    v_dc: np.ndarray
    R: np.ndarray
    psi: np.ndarray
    i_true: np.ndarray  # in the rotor's frame


def known_link(spec: Spec) -> float:
    v_dc = float(spec.drive["v_dc"])
    return v_dc * float(spec.outside["overmodulation"]["link"]) if "overmodulation" in spec.outside else v_dc


def run(spec: Spec, plant: Plant, controller: Controller, random: np.random.Generator) -> Rows:
    T, rows = float(spec.drive["T"]), int(spec.drive["rows"])
    profile, sensors, heat = Profile(spec, random), Sensors(spec, random), Heat(spec)
    p, nominal = spec.machine["p"], known_link(spec)
    # The first periods settle and are not kept.
    first = -400
    kept: dict[str, list[complex]] = {name: [] for name in (f.name for f in dataclasses.fields(Rows))}
    duty: Abc = (0.5, 0.5, 0.5)
    old = duty
    meant = 0j
    stale = plant.current()
    late = float(spec.effects["delay"]["periods"]) if "delay" in spec.effects else 0.0
    shift = float(spec.effects["sample_shift"]["periods"]) if "sample_shift" in spec.effects else 0.0
    kick = 0j
    for k in range(first, rows):
        t = k * T
        at = max(t, 0.0)
        theta_m, w_m = plant.shaft()
        i = plant.current()
        R, psi = heat.step(i, T if k >= 0 else 0.0, at)
        plant.set_machine(R, psi)
        link = nominal
        if ripple := spec.outside.get("link_ripple"):
            link *= 1 + float(ripple["part"]) * math.sin(TURN * float(ripple["Hz"]) * t)
        plant.set_link(link)
        i_exact, i_seen = sensors.current(stale if shift else i)
        theta_exact, theta = sensors.angle(theta_m)
        w_seen = sensors.speed(w_m)
        asked, vector, wanted_duty = controller.step(
            i_seen * turned(-theta), theta, w_seen, nominal, profile.currents(k),
            profile.speed(at) if profile.free else None)
        # The injected voltage is known to the drive, and acts with the rest.
        if profile.kick_V:
            kick = profile.injected(k) * turned(theta + 1.5 * T * p * w_seen)
            wanted_duty = limited(tuple(d + x / nominal for d, x in zip(wanted_duty, phases(kick))))
            asked, vector = asked + profile.kick, vector + kick
        if k >= 0:
            over = "overmodulation" in spec.outside
            row = {"t": t, "i": i_seen, "i_exact": i_exact, "theta": theta, "theta_exact": theta_exact, "w_m": w_seen,
                   "w_exact": w_m, "u": meant if over else vector_of(duty) * nominal, "u_dq": asked, "v_dc": link,
                   "R": R, "psi": psi, "i_true": i * turned(-p * theta_m)}
            for name, value in row.items():
                kept[name].append(value)
        acting = duty
        if beat := spec.outside.get("disturbance"):
            extra = float(beat["volt"]) / nominal * turned(TURN * float(beat["Hz"]) * t)
            acting = limited(tuple(d + x for d, x in zip(duty, phases(extra))))
        # The inverter switches late: the vector before stays that long.
        spans = [(old, late), (acting, 1 - late)] if late else [(acting, 1.0)]
        for held, share in spans:
            if shift and held is acting:
                plant.advance(held, (share - shift) * T)
                stale = plant.current()
                plant.advance(held, shift * T)
            elif share > 0:
                plant.advance(held, share * T)
        old, duty, meant = acting, wanted_duty, vector
    arrays = {name: np.array(values) for name, values in kept.items()}
    for name in ("t", "theta", "theta_exact", "w_m", "w_exact", "v_dc", "R", "psi"):
        arrays[name] = arrays[name].real
    return Rows(**arrays)


def limited(duty: tuple[float, ...]) -> Abc:
    a, b, c = (min(max(d, 0.0), 1.0) for d in duty)
    return a, b, c
