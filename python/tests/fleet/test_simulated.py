"""The quasi-static generator against the simulator of a drive, and what its logs hold."""

import dataclasses

import numpy as np
import pytest

import dqwatch
from dqwatch.fleet.simulated.drive import Wire, Wrong, polled_log, torque_Nm, voltages
from dqwatch.fleet.simulated.planted import TYPES, drawn
from dqwatch.fleet.simulated.write import coast_log, coasting


@pytest.mark.parametrize("number", range(10))
def test_its_voltages_are_the_simulators(number):
    member = drawn(7, 30, healthy=True).members[3 * number + number % 3]
    # The simulator's iron is linear here; its dead time acts on phases, over a width of its own.
    m = dataclasses.replace(member.motor, i_sat_A=1e9, ripple_A=0.0)
    rng = np.random.default_rng(number)
    hold_s, holds = 0.3, 5
    w = rng.choice([-1, 1], holds) * rng.uniform(0.4, 1, holds) * m.speed_rad_s
    i_q = rng.choice([-1, 1], holds) * rng.uniform(0.5, 1, holds) * m.load_Nm
    i_q /= torque_Nm(m, np.zeros(1), np.ones(1), 25.0)[0]
    each = round(hold_s / 0.01)
    sim = dqwatch.simulate(
        {"R_ohm": m.R_ohm, "Ld_H": m.Ld_H, "Lq_H": m.Lq_H, "psi_Wb": m.psi_Wb, "pole_pairs": m.pole_pairs},
        profile={
            "t_s": 0.01 * np.arange(holds * each),
            "i_d_A": np.zeros(holds * each),
            "i_q_A": np.repeat(i_q, each),
            "speed_rad_s": np.repeat(w, each),
            "v_d_V": 0.0,
            "v_q_V": 0.0,
            "control": "current",
            "shaft": "imposed",
        },
        scenario="servo_ideal",
        progress=False,
        settings={
            "drive.v_dc_V": 2 * m.v_dc_V,
            "nonideal.dead_time_V": m.dead_time_V,
            "nonideal.dead_time_width_A": 0.01 * m.load_Nm / np.max(np.abs(i_q)),
        },
    )
    for k in range(holds):
        settled = (sim["t_s"] > hold_s * (k + 0.5)) & (sim["t_s"] < hold_s * (k + 0.9))
        mean = {name: np.array([np.mean(sim[name][settled])]) for name in sim.keys()}
        assert mean["w_m_rad_s"][0] == pytest.approx(w[k], rel=1e-3)
        v_d, v_q = voltages(
            m,
            m.pole_pairs * mean["w_m_rad_s"],
            mean["i_d_A"],
            mean["i_q_A"],
            np.zeros(1),
            np.zeros(1),
            25.0,
            25.0,
            m.v_dc_V,
        )
        size = np.hypot(v_d, v_q)[0]
        assert mean["v_q_V"][0] == pytest.approx(v_q[0], abs=0.004 * size)
        # The ripple that dead time makes of six a turn turns the voltage a little; measured 0.65 % at most.
        assert mean["v_d_V"][0] == pytest.approx(v_d[0], abs=0.008 * size)


def test_its_power_is_the_shafts_and_the_losses():
    m = dataclasses.replace(TYPES["S320"], i_sat_A=1e9)
    i_d, i_q, w_e = np.array([-1.0]), np.array([3.0]), np.array([400.0])
    v_d, v_q = voltages(m, w_e, i_d, i_q, 0 * i_d, 0 * i_d, 60.0, 50.0, m.v_dc_V)
    R = m.R_ohm * (1 + 0.00393 * 35)
    lost = 1.5 * (R + 4 / np.pi * m.dead_time_V / np.hypot(10**0.5, m.ripple_A)) * 10
    assert 1.5 * (v_d * i_d + v_q * i_q) == pytest.approx(
        torque_Nm(m, i_d, i_q, 50.0) * w_e / m.pole_pairs + lost, rel=1e-12
    )


def test_what_comes_over_the_wire_is_quantised_and_by_the_seed():
    m = TYPES["J24"]
    a, b, other = (polled_log(m, Wrong(), Wire(), np.random.default_rng(s), 500, 30.0, 24.0) for s in (1, 1, 2))
    assert all(np.array_equal(a[k], b[k]) for k in a) and not np.array_equal(a["i_q_A"], other["i_q_A"])
    assert np.allclose(a["i_q_A"] / 0.01, np.round(a["i_q_A"] / 0.01), atol=1e-9)
    erpm = a["w_m_rad_s"] * m.pole_pairs * 60 / (2 * np.pi)
    assert np.allclose(erpm, np.round(erpm), atol=1e-6)
    assert np.std(np.diff(a["t_s"])) < 1e-12 and a["temp_winding_C"][-1] > a["temp_winding_C"][0]


def test_a_fleet_has_what_is_planted_and_nothing_else():
    fleet = drawn(3)
    planted = [m.planted for m in fleet.members if m.planted]
    assert len(fleet.members) == 1000 and planted.count("batch") == 10 and planted.count("other_type") == 3
    assert planted.count("weak_magnet") == planted.count("worn_bearing") == 5
    sensors = sum(p.endswith("_sensor") for p in planted), sum(p.startswith("encoder") for p in planted)
    assert sensors == (5, 5) and len(planted) == 33
    assert len({m.batch for m in fleet.members if m.planted == "batch"}) == 1
    bearings = {k for k, m in enumerate(fleet.members) if m.planted == "worn_bearing"}
    coasts = set(coasting(fleet))
    assert bearings < coasts and len(coasts) > 5 * len(bearings)


def test_a_worn_bearing_is_told_by_the_coasting_log():
    fleet = drawn(3)
    k = next(k for k, m in enumerate(fleet.members) if m.planted == "worn_bearing")
    m, _ = fleet.members[k].week(0, fleet.weeks)
    found = dqwatch.fit(coast_log(fleet, k, 0), effects=["coulomb_friction"], machine={"log": {"regime": "mechanical"}})
    friction = next(e for e in found.effects if e.name == "coulomb_friction").parameters["torque_Nm"]
    assert friction.value == pytest.approx(m.coulomb_Nm, rel=0.05)
