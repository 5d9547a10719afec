"""Drives by a seed: machine, modulation, imperfections and driving, as settings of `dqwatch sim`."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable

MODULATIONS = ("centred", "clamped_low", "clamped_high", "clamped_60")


@dataclasses.dataclass(frozen=True)
class Machine:
    """As the drive_* scenarios of sim/ have it, with what their imperfections are scaled by."""

    suffix: str
    pole_pairs: int
    R_ohm: float
    Ld_H: float
    Lq_H: float
    psi_Wb: float
    J_kgm2: float
    v_dc_V: float
    i_max_A: float
    dt_s: float
    top_rad_s: float
    load_Nm: float
    load_hold_s: float
    i_d_A: float
    sensor_A: float
    lean_rad_A: float
    iron_S: float
    hysteresis_S_rad_s: float
    magnet_beta: float
    legs_ohm: float  # of the scenarios' own inverter, as a current meets it

    @property
    def name(self) -> str:
        return self.suffix[1:] or "servo"

    @property
    def L_H(self) -> float:
        return 0.5 * (self.Ld_H + self.Lq_H)


MACHINES = (
    Machine("", 4, 0.9, 2.2e-3, 2.8e-3, 0.12, 2e-3, 320, 15, 1e-4, 150, 3, 0.051, 3, 0.02, 4e-3, 1e-3, 0.4, -0.0011,
            0.025),
    Machine("_joint", 4, 0.5, 1e-3, 1.4e-3, 0.02, 3e-4, 24, 6, 5e-5, 90, 0.35, 0.051, 2, 0.01, 1e-2, 2e-3, 0.5,
            -0.0011, 0.02),
    Machine("_hub", 15, 0.24, 520e-6, 650e-6, 0.0243, 0.02, 48, 20, 5e-5, 45, 4, 0.11, 4, 0.03, 3e-3, 2e-3, 0.8,
            -0.0012, 0.004),
    Machine("_fast", 14, 0.014, 10e-6, 15e-6, 1.456e-3, 1.5e-4, 22, 50, 3.5e-5, 300, 0.5, 0.051, 8, 0.08, 1e-3, 0.03,
            60, -0.0012, 0.0015),
)

# Of the scenario drive_clamped_*: what makes it a drive. Without these it is the machine, its sensors' noise and loops.
PLAIN = tuple(f"{key}=0" for key in (
    "inverter.dead_time_s", "inverter.node_F", "inverter.switch_V", "inverter.switch_ohm", "inverter.diode_V",
    "inverter.diode_ohm", "inverter.knee_A", "inverter.source_ohm", "inverter.link_F", "inverter.ripple_V",
    "inverter.compare_counts",
    "nonideal.iron_loss_S", "nonideal.iron_hysteresis_S_rad_s", "nonideal.winding_alpha_per_K", "sensing.filter_s",
    "nonideal.magnet_beta_per_K", "machine.winding_heat_J_K", "machine.magnet_heat_J_K", "machine.housing_heat_J_K",
    "machine.winding_housing_W_K", "machine.magnet_housing_W_K", "machine.housing_ambient_W_K"))

Settings = dict[str, object]
Draw = Callable[[random.Random, Machine], Settings]


def log_uniform(r: random.Random, low: float, high: float) -> float:
    return low * (high / low) ** r.random()


def either(r: random.Random, low: float, high: float) -> float:
    return r.choice((-1, 1)) * r.uniform(low, high)


def dead_time(r: random.Random, m: Machine) -> Settings:
    return {"inverter.dead_time_s": m.dt_s * r.uniform(0.003, 0.02), "inverter.dead_side": "both"}


def dead_side(r: random.Random, m: Machine) -> Settings:
    return dead_time(r, m) | {"inverter.dead_side": r.choice(("upper", "lower"))}


def slow_edges(r: random.Random, m: Machine) -> Settings:
    # What a tenth of the largest current takes to turn the output over, as part of the dead time.
    dead = dead_time(r, m)
    charge_C = 0.1 * m.i_max_A * dead["inverter.dead_time_s"]  # type: ignore[operator]
    return dead | {"inverter.node_F": charge_C / m.v_dc_V * r.uniform(0.2, 1.5)}


def compensated(r: random.Random, m: Machine) -> Settings:
    return dead_time(r, m) | {"drive.compensation": r.uniform(0.5, 1.5),
                              "drive.compensation_width_A": m.i_max_A * r.uniform(0.005, 0.03)}


def drops(r: random.Random, m: Machine) -> Settings:
    ohm = m.R_ohm * r.uniform(0.01, 0.1)
    return dead_time(r, m) | {"inverter.switch_ohm": ohm, "inverter.diode_V": 0.75, "inverter.diode_ohm": 0.5 * ohm,
                              "inverter.knee_A": 0.01 * m.i_max_A, "inverter.reverse": "channel"}


def bipolar_switches(r: random.Random, m: Machine) -> Settings:
    volt = m.v_dc_V * r.uniform(0.002, 0.01)
    return {"inverter.switch_V": volt, "inverter.diode_V": 0.8 * volt, "inverter.knee_A": 0.01 * m.i_max_A,
            "inverter.reverse": "diode"}


def soft_link(r: random.Random, m: Machine, link: str = "measured") -> Settings:
    ohm = r.uniform(0.01, 0.05) * m.v_dc_V / m.i_max_A
    return {"inverter.source_ohm": ohm, "inverter.link_F": r.uniform(5e-5, 3e-4) / ohm, "drive.link": link}


def rippled_link(r: random.Random, m: Machine, link: str = "measured") -> Settings:
    return {"inverter.ripple_V": r.uniform(0.01, 0.05) * m.v_dc_V, "inverter.ripple_Hz": r.choice((100, 300)),
            "drive.link": link}


def observer(r: random.Random, m: Machine) -> Settings:
    return {"sensing.observer": "true", "sensing.speed_bandwidth_rad_s": 300, "noise.step_theta_m_rad": 0,
            "sensing.observer_lag_s": r.uniform(2e-6, 3e-5),
            "sensing.observer_load_rad_A": m.lean_rad_A * r.uniform(0, 1.5),
            "sensing.observer_noise_rad": r.uniform(0, 0.05), "sensing.observer_corner_rad_s": 100,
            "sensing.observer_bandwidth_rad_s": 500}


def warm(r: random.Random, m: Machine) -> Settings:
    # Copper that warms by some kelvin a second at the rated current, the magnet behind it.
    heat_W = 0.5 * m.R_ohm * m.i_max_A**2
    capacity = heat_W / r.uniform(0.5, 2)
    return {"machine.winding_heat_J_K": capacity, "machine.magnet_heat_J_K": 2 * capacity,
            "machine.housing_heat_J_K": 6 * capacity, "machine.winding_housing_W_K": heat_W / 40,
            "machine.magnet_housing_W_K": heat_W / 200, "machine.housing_ambient_W_K": heat_W / 60,
            "nonideal.winding_alpha_per_K": 0.0039, "nonideal.magnet_beta_per_K": m.magnet_beta}


def iron(r: random.Random, m: Machine) -> Settings:
    size = r.uniform(0.3, 2)
    return {"nonideal.iron_loss_S": size * m.iron_S, "nonideal.iron_hysteresis_S_rad_s": size * m.hysteresis_S_rad_s,
            "nonideal.iron_hysteresis_corner_rad_s": 50, "nonideal.iron_loss_tau_s": 2e-5 if m.L_H < 1e-4 else 5e-5}


def gains(r: random.Random, m: Machine) -> Settings:
    return {f"nonideal.current_gain_{phase}": either(r, 0, 0.015) for phase in "abc"}


def two_sensors(r: random.Random, m: Machine) -> Settings:
    return {"sensing.phases": r.choice(("ab", "bc", "ca")), "nonideal.current_gain_a": either(r, 0, 0.015)}


def offsets(r: random.Random, m: Machine) -> Settings:
    return {f"nonideal.current_offset_{axis}_A": either(r, 0, 0.005) * m.i_max_A for axis in ("alpha", "beta")}


def decided(r: random.Random, m: Machine) -> Settings:
    return {"drive.logged": "decided"}


IMPERFECTIONS: dict[str, Draw] = {
    "dead time": dead_time,
    "dead time of one switch": dead_side,
    "dead time, slow edges": slow_edges,
    "dead time, compensated in part": compensated,
    "drops of switches": drops,
    "bipolar switches": bipolar_switches,
    "soft link, measured": soft_link,
    "soft link, nominal": lambda r, m: soft_link(r, m, "nominal"),
    "rippled link, nominal": lambda r, m: rippled_link(r, m, "nominal"),
    "coarse compare values": lambda r, m: {"inverter.compare_counts": round(log_uniform(r, 200, 5000))},
    "overmodulation": lambda r, m: {"drive.overmodulation": "true", "profile.speed_rad_s.wave": 1.5 * m.top_rad_s},
    "decided voltage logged": decided,
    "currents late": lambda r, m: {"sensing.late_periods": r.uniform(0.01, 0.08)},
    "currents filtered": lambda r, m: {"sensing.filter_s": m.dt_s * r.uniform(0.01, 0.1)},
    "two sensors": two_sensors,
    "sensors' gains": gains,
    "sensors' offsets": offsets,
    "noisy currents": lambda r, m: {"sensing.noise_A": m.i_max_A * log_uniform(r, 5e-4, 1e-2)},
    "coarse currents": lambda r, m: {"noise.step_i_A": m.i_max_A * log_uniform(r, 5e-4, 5e-3)},
    "slow speed loop": lambda r, m: {"sensing.speed_bandwidth_rad_s": log_uniform(r, 100, 1000)},
    "coarse encoder": lambda r, m: {"noise.step_theta_m_rad": 6.283185307179586 / 2 ** r.randint(10, 13)},
    "eccentric encoder": lambda r, m: {"sensing.once_rad": r.uniform(1e-3, 4e-3),
                                       "sensing.twice_rad": r.uniform(0, 2e-3)},
    "encoder's angle late": lambda r, m: {"sensing.angle_late_periods": r.uniform(0.2, 1)},
    "encoder turned": lambda r, m: {"nonideal.angle_offset_rad": either(r, 0.01, 0.1)},
    "observer": observer,
    "heat": warm,
    "iron loss": iron,
    "uneven magnet": lambda r, m: {"nonideal.magnet_asymmetry_Wb": m.psi_Wb * r.uniform(0.005, 0.025)},
    "flux harmonics": lambda r, m: {"nonideal.flux_harmonic_6d_Wb": m.psi_Wb * r.uniform(0, 0.01),
                                    "nonideal.flux_harmonic_6q_Wb": m.psi_Wb * r.uniform(0, 0.01)},
    "rows dropped": lambda r, m: {"nonideal.dropped_fraction": r.uniform(0, 0.01)},
    "noisy voltage and speed": lambda r, m: {"noise.v": r.uniform(0, 0.01), "noise.w": r.uniform(0, 0.003)},
}
# What an observer has not, and what is a fault's own place or leaves no room for it.
OF_ENCODER = ("coarse encoder", "eccentric encoder", "encoder's angle late", "encoder turned")


@dataclasses.dataclass(frozen=True)
class Drive:
    """One simulated drive: what `sim` takes, and what is told of it."""

    machine: Machine
    scenario: str
    seed: int
    title: str
    settings: tuple[tuple[str, str], ...]

    def value(self, key: str) -> str:
        return dict(self.settings).get(key, "")

    @property
    def observed(self) -> bool:
        return self.value("sensing.observer") == "true" or "observer" in self.scenario

    @property
    def looped(self) -> bool:
        """The speed lags."""
        return self.value("sensing.speed_bandwidth_rad_s") != "0"

    @property
    def decided(self) -> bool:
        return self.value("drive.logged") == "decided" or "cheap" in self.scenario

    @property
    def legs_ohm(self) -> float:
        """What a current meets in a leg: channels alone, or a switch and the other one's diode in turn."""
        if "as built" in self.title:
            return self.machine.legs_ohm
        switch, diode = float(self.value("inverter.switch_ohm")), float(self.value("inverter.diode_ohm"))
        return switch if self.value("inverter.reverse") == "channel" else 0.5 * (switch + diode)

    @property
    def common_gain(self) -> float:
        """Of the current sensors that there are: what they share, they do not show."""
        gains = [float(self.value(f"nonideal.current_gain_{phase}") or 0) for phase in
                 self.value("sensing.phases") or "abc"]
        return 1 + sum(gains) / len(gains)

    @property
    def duration_s(self) -> float:
        return float(self.value("duration_s"))

    def with_settings(self, **more: object) -> Drive:
        merged = dict(self.settings) | {key.replace("__", "."): text(value) for key, value in more.items()}
        return dataclasses.replace(self, settings=tuple(merged.items()))

    def arguments(self) -> list[str]:
        chosen = [part for key, value in self.settings for part in ("--set", f"{key}={value}")]
        return ["sim", self.scenario, "--seed", str(self.seed), *chosen]


def text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def current_along_d(r: random.Random, m: Machine) -> Settings:
    """Stepped as field weakening does, or held: at nought, or what a salient machine wants."""
    held = r.random() < 1 / 3
    mean_A = -m.i_d_A * r.uniform(0.2, 1) if held and r.random() < 0.5 else 0
    return {"profile.i_d_A": mean_A, "profile.i_d_A.random": 0 if held else m.i_d_A * r.uniform(0.2, 1)}


def driving(r: random.Random, m: Machine, one_way: bool) -> Settings:
    """Set points drawn: speed to and fro (an observer's: one way), load, some i_d. No test signal."""
    top = m.top_rad_s * r.uniform(0.5, 1)
    speed: Settings = {"profile.speed_rad_s": top if one_way else top * r.uniform(-0.3, 0.3),
                       "profile.speed_rad_s.wave": 0.5 * top if one_way else top * 0.8}
    return speed | {"profile.speed_rad_s.wave_period_s": log_uniform(r, 0.7, 4),
                    "profile.speed_rad_s.shape": r.choice(("sine", "triangle", "square")),
                    "profile.load_Nm.random": m.load_Nm * r.uniform(0.3, 1),
                    "profile.load_Nm.random_hold_s": m.load_hold_s * log_uniform(r, 0.7, 5),
                    "profile.i_d_A.random_hold_s": log_uniform(r, 0.02, 0.3)} | current_along_d(r, m)


def compatible(names: tuple[str, ...]) -> bool:
    if "observer" in names and any(name in OF_ENCODER for name in names):
        return False
    return not ("soft link, measured" in names and any("nominal" in name for name in names))


def seconds_of(r: random.Random, m: Machine, seconds: tuple[float, float]) -> float:
    """Less where the period is short: a drive costs by its rows."""
    return r.uniform(*seconds) * min(1.0, m.dt_s / 5e-5)


def sensed_speed(r: random.Random, m: Machine) -> Settings:
    """The shaft's own, or as a loop has it that follows the angle."""
    return {"sensing.speed_bandwidth_rad_s": r.choice((0, 1)) * log_uniform(r, 300, 3000)}


def drawn(r: random.Random, m: Machine, names: tuple[str, ...], seconds: tuple[float, float]) -> Drive:
    """A machine with these imperfections alone, at sizes drawn."""
    settings: Settings = dict(pair.split("=") for pair in PLAIN)
    settings |= {"method": "rk4", "duration_s": seconds_of(r, m, seconds),
                 "inverter.modulation": r.choice(MODULATIONS)}
    settings |= driving(r, m, "observer" in names) | sensed_speed(r, m)
    for name in names:
        settings |= IMPERFECTIONS[name](r, m)
    return Drive(m, f"drive_clamped{m.suffix}", r.randrange(1, 10**6), " + ".join(names) or "none",
                 tuple((key, text(value)) for key, value in settings.items()))


def built(r: random.Random, m: Machine, kind: str, seconds: tuple[float, float]) -> Drive:
    """A scenario of sim/ with all its imperfections, driven by other set points."""
    settings: Settings = {"method": "rk4", "duration_s": seconds_of(r, m, seconds),
                          "inverter.modulation": r.choice(MODULATIONS)}
    settings |= driving(r, m, kind == "observer")
    return Drive(m, f"drive_{kind}{m.suffix}", r.randrange(1, 10**6), f"as built, {kind}",
                 tuple((key, text(value)) for key, value in settings.items()))
