"""motulator's drive: its converter, machine, shaft, current and speed controllers and modulator. What its machine and
its inverter lack is put in here: saturation as its own examples have it, an inverter's loss, iron, shorted turns."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from motulator.common.control import PWM
from motulator.drive.control import SpeedController
from motulator.drive.control.sm._current_vector import CurrentController
from motulator.drive.model import (
    CarrierComparison, Drive, ExternalRotorSpeed, StiffMechanicalSystem, SynchronousMachine, VoltageSourceConverter)
from motulator.drive.utils import SynchronousMachinePars

from .draw import Spec
from .drive import Abc, Profile, known_link, phases, turned, vector_of

Effect = dict[str, float | str]


class Iron:
    """Currents of the fluxes from one energy: 1/L grows with a power of the flux."""

    def __init__(self, spec: Spec):
        m, e = spec.machine, spec.effects.get("saturation") or spec.effects["saturation_cross"]
        self.Ld, self.Lq, self.psi = m["Ld"], m["Lq"], m["psi"]
        self.power = float(e["power"])
        amp = float(spec.drive["amp"])
        top_q = m["Lq"] * amp
        # At full current the axes have lost these shares: (1 + share) i for the same flux.
        self.qq = float(e["q"]) / top_q ** self.power
        # The d axis' iron carries the magnet: it is saturated by that much more than at zero flux.
        self.dd = float(e["d"]) / (self.psi + m["Ld"] * amp) ** self.power
        self.dq = float(e["cross"]) / ((self.psi + m["Ld"] * amp) ** 2 * top_q ** 2) * top_q ** 2 / m["Lq"]
        # 1/L_d at the magnet's own flux is the machine's.
        self.a = 1 / (self.Ld * (1 + self.dd * (self.power + 1) * self.psi ** self.power))
        self.magnet = self.a * (1 + self.dd * self.psi ** self.power) * self.psi
        self.b = 1 / self.Lq - 2 * self.dq * self.psi ** 2
        self.cross = float(e["cross"]) > 0

    def __call__(self, flux: complex) -> complex:
        x, y, s = flux.real, flux.imag, self.power
        i_d = self.a * (1 + self.dd * abs(x) ** s) * x - self.magnet
        i_q = (1 + self.qq * abs(y) ** s) * y / self.Lq
        if self.cross:
            # Energy dq (x^2 - psi^2) y^2: nothing at the magnet's flux, so that L_q there stays.
            i_d += 2 * self.dq * x * y ** 2
            i_q += 2 * self.dq * (x ** 2 - self.psi ** 2) * y
        return complex(i_d, i_q)


class Machine(SynchronousMachine):
    """With a current that iron or shorted turns draw from the rotational EMF."""

    def __init__(self, par: Any, spec: Spec, iron: Iron | None):
        super().__init__(par, i_s=iron)
        self.effects, self.asymmetry = spec.effects, spec.effects.get("magnet_asymmetry")
        self.w = 0.0

    @property
    def i_s(self) -> complex:
        flux = self.state.psi_s
        if self.asymmetry:
            # exp(j theta_m): the electrical angle over the pole pairs, unwrapped by the shaft.
            angle = self.theta_mechanical() + float(self.asymmetry["phase"])
            flux = flux - float(self.asymmetry["weber"]) * math.cos(angle)
        if callable(self._i_s):
            return self._i_s(flux)
        return complex((flux.real - self.par.psi_f) / self.par.L_d, flux.imag / self.par.L_q)

    def theta_mechanical(self) -> float:
        return self.turn

    turn = 0.0

    def drawn(self) -> complex:
        """In the rotor's frame."""
        emf = 1j * self.w * self.state.psi_s
        if loss := self.effects.get("iron_loss"):
            return emf / float(loss["ohm"])
        if short := self.effects.get("turn_short"):
            # Only phase a's EMF drives it: two thirds on the alpha axis.
            angle = self.state.exp_j_theta_m
            return 2 / 3 / float(short["ohm"]) * (emf * angle).real * np.conj(angle)
        return 0j

    def set_outputs(self, t: float) -> None:
        super().set_outputs(t)
        self.out.i_s = self.out.i_s + self.drawn()
        self.out.i_ss = self.out.i_s * self.state.exp_j_theta_m


class SoftLink(VoltageSourceConverter):
    """Its capacitor behind a source's resistance."""

    def __init__(self, volt: float, ohm: float, farad: float):
        super().__init__(volt, C_dc=farad)
        self.volt, self.ohm = volt, ohm

    def set_inputs(self, t: float) -> None:
        self.inp.i_dc = (self.volt - self.u_dc) / self.ohm


def loss_of(effect: Effect, i: float) -> float:
    x, law = i / float(effect["width"]), effect["law"]
    volt = float(effect["volt"])
    if law == "arctan":
        return volt * 2 / math.pi * math.atan(x * math.pi / 2)
    if law == "ramp":
        return volt * min(max(x, -1.0), 1.0)
    if law == "tanh":
        return volt * math.tanh(x)
    # A ramp to a plateau that still rises a little, as diodes have it.
    return volt * (0.9 * min(max(x, -1.0), 1.0) + 0.1 * math.tanh(0.15 * x))


class Inverter(Drive):
    """The legs' loss by the phase currents, and unlike phases, between converter and machine."""

    def __init__(self, converter: Any, machine: Any, mechanics: Any, effects: dict[str, Effect]):
        super().__init__(converter, machine, mechanics)
        self.dead, self.unlike = effects.get("dead_time"), effects.get("phase_resistance_imbalance")
        self.lag = effects.get("sensor_lag")

    def interconnect(self, t: float) -> None:
        machine, speed = self.machine, self.mechanics.out.w_M
        self.converter.inp.i_cs = machine.out.i_ss
        u = self.converter.out.u_cs
        if self.dead or self.unlike:
            a, b, c = phases(machine.out.i_ss)
            if self.dead:
                u -= vector_of((loss_of(self.dead, a), loss_of(self.dead, b), loss_of(self.dead, c)))
            if self.unlike:
                u -= vector_of((float(self.unlike["a"]) * a, float(self.unlike["b"]) * b, 0.0))
        machine.inp.u_ss = u
        self.mechanics.inp.tau_M = machine.out.tau_M
        machine.inp.w_M = speed


class MotulatorPlant:
    def __init__(self, spec: Spec, profile: Profile):
        m, T = spec.machine, float(spec.drive["T"])
        self.T = T
        self.p = m["p"]
        par = SynchronousMachinePars(n_p=int(m["p"]), R_s=m["R"], L_d=m["Ld"], L_q=m["Lq"], psi_f=m["psi"])
        saturates = "saturation" in spec.effects or "saturation_cross" in spec.effects
        self.iron = Iron(spec) if saturates else None
        self.machine = Machine(par, spec, self.iron)
        v_dc = known_link(spec)
        scale = spec.effects.get("voltage_scale")
        if scale:
            ohm = float(scale["ohm"])
            self.converter = SoftLink(v_dc, ohm, float(scale["farad_s"]) / ohm)
        else:
            self.converter = VoltageSourceConverter(v_dc)
        torque = 1.5 * m["p"] * m["psi"] * float(spec.drive["amp"])
        if spec.drive["free"]:
            self.shaft_model: Any = StiffMechanicalSystem(J=m["J"], B_L=0.03 * torque / float(spec.drive["w_m"]))
            self.shaft_model.state.w_M = profile.speed(0.0)
        else:
            # A load machine follows its profile within some periods.
            self.shaft_model = ExternalRotorSpeed(w_M=lambda t: profile.speed(max(t, 0.0)))
        self.model = Inverter(self.converter, self.machine, self.shaft_model, spec.effects)
        carrier = CarrierComparison() if spec.drive["pwm"] and not self.machine.effects.keys() & {
            "iron_loss", "turn_short", "sensor_lag"} else None
        self.pwm = carrier
        self.t = -400 * T
        self.theta_m, self.seen = 0.0, 0j
        self.lag = float(spec.effects["sensor_lag"]["tau"]) if "sensor_lag" in spec.effects else 0.0
        # Steps that a narrow law of the inverter allows.
        dead = spec.effects.get("dead_time")
        steep = abs(float(dead["volt"])) / float(dead["width"]) / min(m["Ld"], m["Lq"]) * T if dead else 0.0
        self.steps = max(2, math.ceil(2 * steep))
        self.settle()

    def settle(self) -> None:
        self.converter.inp.q_cs = 0j
        self.model.rhs(self.t, self.model.get_initial_values())
        self.seen = self.machine.out.i_ss

    def current(self) -> complex:
        if self.lag:
            return self.seen
        self.model.rhs(self.t, self.model.get_initial_values())
        return self.machine.out.i_ss

    def shaft(self) -> tuple[float, float]:
        return self.theta_m, float(np.real(self.shaft_model.meas_speed()))

    def torque(self) -> float:
        return float(self.machine.tau_M)

    def set_machine(self, R: float, psi: float) -> None:
        self.machine.par.R_s, self.machine.par.psi_f = R, psi

    def set_link(self, volt: float) -> None:
        if self.converter.par.C_dc is None:
            self.converter.par.u_dc = volt

    def rhs(self, t: float, y: np.ndarray) -> np.ndarray:
        return np.array(self.model.rhs(t, list(y)), dtype=complex)

    def speed_now(self) -> float:
        return float(np.real(self.shaft_model.out.w_M))

    def advance(self, duty: Abc, span_s: float) -> None:
        if self.pwm and abs(span_s / self.T - 1) < 1e-9:
            spans, vectors = self.pwm(span_s, duty)
        else:
            spans, vectors = [span_s], [vector_of(duty)]
        for span, vector in zip(spans, vectors):
            steps = max(1, math.ceil(self.steps * span / self.T - 1e-9))
            for _ in range(steps if span > 0 else 0):
                self.step(complex(vector), span / steps)

    def step(self, vector: complex, h: float) -> None:
        """Runge and Kutta's of order four: finer than the tolerance of its own solver, 1e-3, and five times as fast."""
        self.converter.inp.q_cs = vector
        y = np.array(self.model.get_initial_values(), dtype=complex)
        w0 = self.shaft()[1]
        self.machine.w, self.machine.turn = self.p * w0, self.theta_m
        k1 = self.rhs(self.t, y)
        i1 = self.machine.out.i_ss
        self.machine.turn = self.theta_m + 0.5 * h * w0
        k2 = self.rhs(self.t + h / 2, y + h / 2 * k1)
        k3 = self.rhs(self.t + h / 2, y + h / 2 * k2)
        self.machine.turn = self.theta_m + h * w0
        k4 = self.rhs(self.t + h, y + h * k3)
        self.t += h
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        self.rhs(self.t, y)
        w1 = self.speed_now()
        # The angle by the shaft's own state, turns counted.
        wrapped = float(np.angle(self.shaft_model.state.exp_j_theta_M))
        guess = self.theta_m + 0.5 * h * (w0 + w1)
        self.theta_m = guess + math.remainder(wrapped - guess, 2 * math.pi)
        self.machine.turn, self.machine.w = self.theta_m, self.p * w1
        if self.lag:
            # First order, the current straight between the ends.
            i2, x = self.machine.out.i_ss, h / self.lag
            slope = (i2 - i1) / x
            self.seen = (self.seen - i1 + slope) * math.exp(-x) + i2 - slope


class MotulatorController:
    """motulator's complex-vector current controller, its speed controller and space-vector modulator."""

    def __init__(self, spec: Spec):
        m = spec.machine
        par = SimpleNamespace(L_d=m["Ld"], L_q=m["Lq"])
        self.T, self.p = float(spec.drive["T"]), m["p"]
        self.currents = CurrentController(par, float(spec.drive["bandwidth"]))
        torque = 1.5 * m["p"] * m["psi"] * float(spec.drive["amp"])
        self.per_ampere = torque / float(spec.drive["amp"])
        self.speed = SpeedController(m["J"], min(60.0, 0.05 * float(spec.drive["bandwidth"])), torque)
        self.pwm = PWM()

    def step(self, i_dq: complex, theta: float, w_m: float, v_dc: float, wanted: complex | None,
             speed: float | None) -> tuple[complex, complex, Abc]:
        w_e, reference = self.p * w_m, wanted or 0j
        if speed is not None:
            torque = self.speed.output(speed, w_m)
            self.speed.update(self.T, torque)
            reference += 1j * torque / self.per_ampere
        realized = self.pwm.get_realized_voltage() * turned(-theta)
        u = self.currents.output(reference, i_dq)
        duty = self.pwm(self.T, u * turned(theta), v_dc, w_e)
        self.currents.update(self.T, realized, w_e)
        a, b, c = (float(d) for d in duty)
        return u, u * turned(theta + 1.5 * self.T * w_e), (a, b, c)
