"""A fleet drawn by a seed: motors of three types as made, temperatures, firmware, and what is wrong with some."""

from __future__ import annotations

import dataclasses
import datetime

import numpy as np

from .drive import Array, Motor, Wire, Wrong, polled_log

TYPES: dict[str, Motor] = {
    "J24": Motor(4, 0.5, 1.0e-3, 1.0e-3, 0.020, 2e-4, 2e-4, 0.01, 24.0, 0.24, 40, 0.8, 110, 0.35),
    "H48": Motor(15, 0.12, 0.35e-3, 0.35e-3, 0.016, 2e-2, 1e-3, 0.15, 48.0, 0.40, 70, 1.4, 45, 5.0),
    "S320": Motor(4, 0.9, 2.2e-3, 2.8e-3, 0.120, 1e-3, 1e-3, 0.10, 320.0, 2.5, 40, 0.8, 150, 3.0),
}
FIRMWARE: dict[str, float] = {"3.1": 1.0, "3.2": 0.7, "4.0": 0.35}  # of the type's dead time
SITES = ("Aalen", "Brno", "Como", "Delft", "Espoo")
BATCH = 10
FIRST_DAY = datetime.date(2026, 1, 5)

# Deviations of manufacture, and of one batch from the next, as parts of a value.
MADE = {"R_ohm": 0.015, "psi_Wb": 0.008, "L": 0.02, "friction": 0.10}
BETWEEN = {"R_ohm": 0.003, "psi_Wb": 0.002, "L": 0.004, "friction": 0.02}


@dataclasses.dataclass(frozen=True)
class Member:
    """One motor. `said` is the type that its papers name, `planted` what is wrong with it, "" for nothing."""

    name: str
    said: str
    batch: str
    axis: str
    site: str
    firmware: str
    motor: Motor
    planted: str = ""
    size: float = 0.0

    def week(self, week: float, weeks: int) -> tuple[Motor, Wrong]:
        """The motor and what its log has wrong, `week` weeks after the first."""
        m, x = self.motor, self.size
        part = week / max(1, weeks - 1)
        if self.planted == "weak_magnet":
            return dataclasses.replace(m, psi_Wb=m.psi_Wb * (1 - x * (0.4 + 0.6 * part))), Wrong()
        if self.planted == "current_sensor":
            return m, Wrong(current_gain=1 + x * part)
        if self.planted == "voltage_sensor":
            return m, Wrong(voltage_gain=1 + x * part)
        if self.planted == "encoder_zero":
            return m, Wrong(angle_rad=x)
        if self.planted == "encoder_scale":
            return m, Wrong(speed_gain=1 + x)
        if self.planted == "worn_bearing":
            return dataclasses.replace(m, coulomb_Nm=m.coulomb_Nm * (1 + x), B_Nms_rad=m.B_Nms_rad * (1 + x)), Wrong()
        return m, Wrong()


@dataclasses.dataclass(frozen=True)
class Fleet:
    """Motors, and what happens to many at once: at one site the supply sags from a week on."""

    seed: int
    weeks: int
    rows: int
    members: tuple[Member, ...]
    sagging_site: str
    sag: float
    sag_week: int

    def day(self, week: int) -> datetime.date:
        """The day of a week's log."""
        return FIRST_DAY + datetime.timedelta(weeks=week)

    def random(self, *words: int) -> np.random.Generator:
        """A stream of its own for these words."""
        return np.random.default_rng([self.seed, *words])

    def log(self, number: int, week: int) -> dict[str, Array]:
        """Motor `number`'s polled log of that week."""
        member = self.members[number]
        rng = self.random(1, number, week)
        motor, wrong = member.week(week, self.weeks)
        season = 8 * np.sin(2 * np.pi * (week - 2) / 26)
        start_C = 38 + season + 3 * SITES.index(member.site) + rng.normal(0, 6)
        sags = member.site == self.sagging_site and week >= self.sag_week
        v_dc_V = motor.v_dc_V * (1 - self.sag * sags) * (1 + 0.004 * rng.standard_normal())
        # No week's work is quite like the last.
        load = motor.load_Nm * rng.uniform(0.85, 1.15)
        return polled_log(dataclasses.replace(motor, load_Nm=load), wrong, Wire(), rng, self.rows, start_C, v_dc_V)


def made(like: Motor, firmware: str, rng: np.random.Generator, batch: dict[str, float]) -> Motor:
    """A motor as manufacture spreads it; `batch` has its batch's offsets (logarithms)."""

    def part(name: str) -> float:
        return float(np.exp(batch[name] + MADE[name] * np.clip(rng.standard_normal(), -3, 3)))

    L, friction = part("L"), part("friction")
    return dataclasses.replace(
        like,
        R_ohm=like.R_ohm * part("R_ohm"),
        psi_Wb=like.psi_Wb * part("psi_Wb"),
        Ld_H=like.Ld_H * L,
        Lq_H=like.Lq_H * L,
        coulomb_Nm=like.coulomb_Nm * friction,
        B_Nms_rad=like.B_Nms_rad * friction,
        dead_time_V=like.dead_time_V * FIRMWARE[firmware] * float(np.exp(0.02 * np.clip(rng.standard_normal(), -3, 3))),
    )


def drawn(
    seed: int,
    motors: int = 1000,
    weeks: int = 8,
    rows: int = 3000,
    each: int | None = None,
    batch: int = BATCH,
    healthy: bool = False,
) -> Fleet:
    """The fleet of a seed, in batches of so many. `each`: motors with each single fault; without, one in two hundred.
    `healthy`: nothing is planted, and no supply sags."""
    rng = np.random.default_rng([seed, 0])
    each = max(1, motors // 200) if each is None else each
    names = list(TYPES)
    members: list[Member] = []
    offsets: dict[str, float] = {}
    for k in range(motors):
        if k % batch == 0:
            kind = names[k // batch % len(names)]
            offsets = {name: sd * rng.standard_normal() for name, sd in BETWEEN.items()}
        firmware = str(rng.choice(list(FIRMWARE)))
        members.append(
            Member(
                f"M{k:05d}",
                kind,
                f"{kind}-{k // batch:04d}",
                f"axis {1 + k % 6}",
                SITES[int(rng.integers(len(SITES)))],
                firmware,
                made(TYPES[kind], firmware, rng, offsets),
            )
        )
    if healthy:
        return Fleet(seed, weeks, rows, tuple(members), "", 0.0, weeks)
    free = [int(k) for k in rng.permutation(motors)]
    # One whole batch, then single motors of the others.
    low = free[0] // batch * batch
    for k in range(low, min(motors, low + batch)):
        m = members[k].motor
        members[k] = dataclasses.replace(
            members[k], planted="batch", size=0.04, motor=dataclasses.replace(m, psi_Wb=0.96 * m.psi_Wb)
        )
    free = [k for k in free if k // batch * batch != low]

    def plant(what: str, size: float) -> None:
        k = free.pop()
        members[k] = dataclasses.replace(members[k], planted=what, size=size)

    for _ in range(each):
        plant("weak_magnet", rng.uniform(0.07, 0.15))
        plant("worn_bearing", rng.uniform(1.5, 4.0))
        plant(
            "current_sensor" if rng.random() < 0.6 else "voltage_sensor", rng.choice([-1, 1]) * rng.uniform(0.08, 0.2)
        )
        if rng.random() < 0.6:
            plant("encoder_zero", rng.choice([-1, 1]) * rng.uniform(0.06, 0.2))
        else:
            plant("encoder_scale", rng.choice([2000 / 2500, 2500 / 2048, 4096 / 5000, 1000 / 1024 * 1.25]) - 1)
    for _ in range(3 if motors >= 200 else 1):
        k = free.pop()
        other = names[(names.index(members[k].said) + 1) % len(names)]
        stranger = made(TYPES[other], members[k].firmware, rng, dict.fromkeys(BETWEEN, 0.0))
        members[k] = dataclasses.replace(members[k], planted="other_type", motor=stranger)
    return Fleet(seed, weeks, rows, tuple(members), SITES[int(rng.integers(len(SITES)))], 0.08, max(1, weeks // 2))
