"""A drive's polled log from settled equations: means over each interval, the speed of its end, a wire's quanta."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

Array = npt.NDArray[np.float64]

COPPER_PER_K = 0.00393
MAGNET_PER_K = -0.0011
REFERENCE_C = 25.0
RISE_K, WARMING_S = 6.0, 90.0


@dataclasses.dataclass(frozen=True)
class Motor:
    """One machine at 25 °C on its inverter. Inductances fall with the current as L/(1 + (|i|/i_sat)²)."""

    pole_pairs: int
    R_ohm: float
    Ld_H: float
    Lq_H: float
    psi_Wb: float
    J_kgm2: float
    B_Nms_rad: float
    coulomb_Nm: float
    v_dc_V: float
    dead_time_V: float  # a phase, at v_dc_V
    i_sat_A: float
    ripple_A: float  # within it the dead time's loss is not whole
    speed_rad_s: float  # the largest of its work
    load_Nm: float
    switch_Hz: float = 20e3


@dataclasses.dataclass(frozen=True)
class Wrong:
    """What the log has wrong: gains of sensors, the angle's zero (electrical), the speed's scale."""

    current_gain: float = 1.0
    voltage_gain: float = 1.0
    angle_rad: float = 0.0
    speed_gain: float = 1.0


@dataclasses.dataclass(frozen=True)
class Wire:
    """A poll: its rate, and the steps in which numbers come."""

    rate_Hz: float = 20.0
    step_i_A: float = 0.01
    step_v_V: float = 0.001
    step_erpm: float = 1.0
    step_v_dc_V: float = 0.1
    noise_i_A: float = 0.003
    noise_w: float = 0.002  # of the top speed, of the instant
    fine: int = 8  # points within an interval


def voltages(
    m: Motor,
    w_e: Array,
    i_d: Array,
    i_q: Array,
    di_d: Array,
    di_q: Array,
    winding_C: Array | float,
    magnet_C: Array | float,
    v_dc_V: float,
) -> tuple[Array, Array]:
    """v_d, v_q in V: electrical speed in rad/s, currents in A, their slopes in A/s, temperatures in °C."""
    R = m.R_ohm * (1 + COPPER_PER_K * (winding_C - REFERENCE_C))
    psi = m.psi_Wb * (1 + MAGNET_PER_K * (magnet_C - REFERENCE_C))
    size = np.hypot(i_d, i_q)
    soft = 1 / (1 + (size / m.i_sat_A) ** 2)
    lost = 4 / np.pi * m.dead_time_V * v_dc_V / m.v_dc_V / np.hypot(size, m.ripple_A)
    v_d = (R + lost) * i_d + m.Ld_H * soft * di_d - w_e * m.Lq_H * soft * i_q
    v_q = (R + lost) * i_q + m.Lq_H * soft * di_q + w_e * (m.Ld_H * soft * i_d + psi)
    return v_d, v_q


def torque_Nm(m: Motor, i_d: Array, i_q: Array, magnet_C: Array | float) -> Array:
    """Torque in Nm of currents in A."""
    psi = m.psi_Wb * (1 + MAGNET_PER_K * (magnet_C - REFERENCE_C))
    soft = 1 / (1 + (np.hypot(i_d, i_q) / m.i_sat_A) ** 2)
    return np.asarray(1.5 * m.pole_pairs * (psi + (m.Ld_H - m.Lq_H) * soft * i_d) * i_q)


def held(rng: np.random.Generator, points: int, hold: int, lag: float, low: float, high: float) -> Array:
    """Levels drawn anew every `hold` points, through two lags of `lag` points."""
    levels = rng.uniform(low, high, points // hold + 2)
    x = np.repeat(levels, hold)[int(rng.integers(hold)) :][:points]
    keep = float(np.exp(-1 / lag))
    for _ in range(2):
        x, _state = lfilter([1 - keep], [1, -keep], x, zi=[keep * x[0]])
    return np.asarray(x)


def work(m: Motor, rng: np.random.Generator, points: int, step_s: float) -> tuple[Array, Array]:
    """Speed in rad/s and load in Nm of a machine that goes from task to task, in both directions."""
    w = held(rng, points, max(1, round(2.0 / step_s)), 0.06 / step_s, -1.0, 1.0) * m.speed_rad_s
    load = held(rng, points, max(1, round(1.3 / step_s)), 0.02 / step_s, -1.0, 1.0) * m.load_Nm
    return w, load


def rounded(x: Array, step: float) -> Array:
    """To the nearest step; 0: as it is."""
    return step * np.round(x / step) if step > 0 else x


def polled_log(
    m: Motor, wrong: Wrong, wire: Wire, rng: np.random.Generator, rows: int, start_C: float, v_dc_V: float
) -> dict[str, Array]:
    """Columns of a log of `rows` polls, named as dqwatch reads them; the winding warms from `start_C`."""
    fine = wire.fine
    step_s = 1 / (wire.rate_Hz * fine)
    points = (rows + 1) * fine
    w, load = work(m, rng, points, step_s)
    warm = 1 - np.exp(-step_s * np.arange(points) / WARMING_S)
    winding_C, magnet_C = start_C + RISE_K * warm, start_C - 4 + 0.4 * RISE_K * warm
    friction = m.B_Nms_rad * w + m.coulomb_Nm * np.tanh(w / (0.01 * m.speed_rad_s))
    asked = m.J_kgm2 * np.gradient(w, step_s) + friction + load
    # The controller holds what it takes for i_d at zero; the shaft wants its torque all the same.
    c, s = np.cos(wrong.angle_rad), np.sin(wrong.angle_rad)
    size = asked / torque_Nm(m, np.zeros(1), np.ones(1), magnet_C) / c
    i_d, i_q = -s * size, c * size
    p = m.pole_pairs
    v_d, v_q = voltages(
        m, p * w, i_d, i_q, np.gradient(i_d, step_s), np.gradient(i_q, step_s), winding_C, magnet_C, v_dc_V
    )

    def mean(x: Array) -> Array:
        return np.asarray(x[fine // 2 : fine // 2 + rows * fine].reshape(rows, fine).mean(axis=1))

    ends = fine // 2 + fine * np.arange(1, rows + 1)
    i_noise = wire.noise_i_A * rng.standard_normal((2, rows))
    erpm = 60 / (2 * np.pi) * p
    w_seen = 0.5 * (w[ends - 1] + w[ends])
    w_seen = wrong.speed_gain * w_seen + wire.noise_w * m.speed_rad_s * rng.standard_normal(rows)
    return {
        "t_s": np.arange(rows) / wire.rate_Hz,
        "v_d_V": rounded(wrong.voltage_gain * mean(c * v_d + s * v_q), wire.step_v_V),
        "v_q_V": rounded(wrong.voltage_gain * mean(c * v_q - s * v_d), wire.step_v_V),
        "i_d_A": rounded(wrong.current_gain * mean(c * i_d + s * i_q) + i_noise[0], wire.step_i_A),
        "i_q_A": rounded(wrong.current_gain * mean(c * i_q - s * i_d) + i_noise[1], wire.step_i_A),
        "w_m_rad_s": rounded(w_seen * erpm, wire.step_erpm) / erpm,
        "v_dc_V": rounded(wrong.voltage_gain * v_dc_V + 0.05 * rng.standard_normal(rows), wire.step_v_dc_V),
        "temp_winding_C": rounded(mean(winding_C) + 0.3 * rng.standard_normal(rows), 0.1),
    }
