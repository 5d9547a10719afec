"""gym-electric-motor's drive: its bridge with interlocking time, supply, machine and loads. It brings no controller: a
PI pair with decoupling and a space-vector modulator stand here."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gym_electric_motor.physical_systems import SynchronousMotorSystem
from gym_electric_motor.physical_systems.converters import ContB6BridgeConverter
from gym_electric_motor.physical_systems.electric_motors import PermanentMagnetSynchronousMotor
from gym_electric_motor.physical_systems.mechanical_loads import ExternalSpeedLoad, PolynomialStaticLoad
from gym_electric_motor.physical_systems.solvers import ScipyOdeSolver
from gym_electric_motor.physical_systems.voltage_supplies import IdealVoltageSupply, RCVoltageSupply

from .draw import Spec
from .drive import Abc, Profile, known_link, limited, phases, turned


class GemPlant:
    # It holds dq voltages over a step: short ones make the vector that an inverter holds.
    STEPS = 4

    def __init__(self, spec: Spec, profile: Profile):
        m, T = spec.machine, float(spec.drive["T"])
        self.tau, self.p = T / self.STEPS, m["p"]
        v_dc, amp, w_top = known_link(spec), float(spec.drive["amp"]), float(spec.drive["w_m"])
        dead = spec.effects.get("dead_time")
        converter = ContB6BridgeConverter(
            tau=self.tau, interlocking_time=abs(float(dead["volt"])) / v_dc * self.tau if dead else 0.0)
        limits = {"omega": 3 * w_top, "torque": 30 * m["p"] * m["psi"] * amp, "i": 5 * amp, "u": 2 * v_dc}
        motor = PermanentMagnetSynchronousMotor(
            motor_parameter={"p": int(m["p"]), "l_d": m["Ld"], "l_q": m["Lq"], "j_rotor": m["J"], "r_s": m["R"],
                             "psi_p": m["psi"]}, nominal_values=limits, limit_values=limits)
        scale = spec.effects.get("voltage_scale")
        supply: Any = IdealVoltageSupply(v_dc)
        if scale:
            ohm = float(scale["ohm"])
            supply = RCVoltageSupply(v_dc, {"R": ohm, "C": float(scale["farad_s"]) / ohm})
        if spec.drive["free"]:
            torque = 1.5 * m["p"] * m["psi"] * amp
            load: Any = PolynomialStaticLoad(
                load_parameter={"a": 0.0, "b": 0.03 * torque / w_top, "c": 0.0, "j_load": 1e-9},
                load_initializer={"states": {"omega": profile.speed(0.0)}, "interval": [[-w_top, w_top]],
                                  "random_init": None, "random_params": (None, None)})
        else:
            load = ExternalSpeedLoad(lambda t: profile.speed(max(t - 400 * T, 0.0)), tau=self.tau)
        self.system = SynchronousMotorSystem(
            control_space="abc", converter=converter, motor=motor, load=load, supply=supply,
            ode_solver=ScipyOdeSolver("dopri5"), tau=self.tau)
        self.system.reset()
        self.motor, self.supply = motor, supply
        self.at_w, self.at_i = self.system._omega_ode_idx, self.system._ode_currents_idx
        self.at_angle = self.system._ode_epsilon_idx
        self.machine = (m["R"], m["psi"])

    def state(self) -> np.ndarray:
        return self.system._ode_solver.y

    def current(self) -> complex:
        y = self.state()
        return complex(y[self.at_i[0]], y[self.at_i[1]]) * turned(float(y[self.at_angle]))

    def shaft(self) -> tuple[float, float]:
        y = self.state()
        return float(y[self.at_angle]) / self.p, float(y[self.at_w])

    def torque(self) -> float:
        return float(self.motor.torque(self.state()[self.system._motor_ode_idx]))

    def set_machine(self, R: float, psi: float) -> None:
        if (R, psi) == self.machine:
            return
        self.machine = (R, psi)
        self.motor._motor_parameter["r_s"], self.motor._motor_parameter["psi_p"] = R, psi
        self.motor._update_model()

    def set_link(self, volt: float) -> None:
        if isinstance(self.supply, IdealVoltageSupply):
            self.supply._u_nominal = volt

    def advance(self, duty: Abc, span_s: float) -> None:
        steps = max(1, math.ceil(span_s / self.tau - 1e-9))
        h = span_s / steps
        # A part of a period is as many shorter steps.
        share = self.system.converter._interlocking_time / self.system.converter._tau
        self.system._tau = h
        self.system.converter.tau = h
        for sub in self.system.converter._subconverters:
            sub.tau, sub._interlocking_time = h, share * h
        self.system.converter._interlocking_time = share * h
        action = np.array([2 * d - 1 for d in duty])
        for _ in range(steps):
            # Its frame is that of the step's beginning: half a step's turn back, and the mean is the held vector's.
            self.system.simulate(self.turned_back(action, h))

    def turned_back(self, action: np.ndarray, h: float) -> np.ndarray:
        zero = float(action.sum()) / 3
        vector = complex((2 * action[0] - action[1] - action[2]) / 3, (action[1] - action[2]) / math.sqrt(3))
        return np.array(phases(vector * turned(-0.5 * h * self.p * self.shaft()[1]))) + zero


class GemController:
    """Current loops that cancel the machine's pole, the rotational voltages fed forward; the speed's by the inertia."""

    def __init__(self, spec: Spec):
        m = spec.machine
        self.m, self.T, self.p = m, float(spec.drive["T"]), m["p"]
        self.amp, self.bandwidth = float(spec.drive["amp"]), float(spec.drive["bandwidth"])
        self.integral, self.speed_integral = 0j, 0.0

    def step(self, i_dq: complex, theta: float, w_m: float, v_dc: float, wanted: complex | None,
             speed: float | None) -> tuple[complex, complex, Abc]:
        m, w_e, reference = self.m, self.p * w_m, wanted or 0j
        if speed is not None:
            a, k = min(60.0, 0.05 * self.bandwidth), m["J"] / (1.5 * m["p"] * m["psi"])
            self.speed_integral += a * a / 4 * k * (speed - w_m) * self.T
            self.speed_integral = min(max(self.speed_integral, -self.amp), self.amp)
            reference += 1j * min(max(a * k * (speed - w_m) + self.speed_integral, -self.amp), self.amp)
        error = reference - i_dq
        feed = complex(-w_e * m["Lq"] * i_dq.imag, w_e * (m["Ld"] * i_dq.real + m["psi"]))
        u = self.bandwidth * complex(m["Ld"] * error.real, m["Lq"] * error.imag) + self.integral + feed
        most = v_dc / math.sqrt(3)
        if abs(u) < most:
            self.integral += self.bandwidth * m["R"] * error * self.T
        vector = u * turned(theta + 1.5 * self.T * w_e)
        abc = phases(vector)
        zero = 0.5 * (max(abc) + min(abc))
        return u, vector, limited(tuple(x / v_dc - zero / v_dc + 0.5 for x in abc))
