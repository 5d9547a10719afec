"""Simulated drives do what arrays ask of them, and what a controller of one's own decides."""

from __future__ import annotations

import numpy as np
import pytest

import dqwatch

QUIET = {"i": 0.0, "v": 0.0, "w": 0.0, "theta": 0.0, "v_dc": 0.0, "temp": 0.0, "torque": 0.0}
NO_VOLTAGES = {"v_d_V": 0.0, "v_q_V": 0.0}


def test_an_imposed_speed_is_the_array() -> None:
    t_s = np.arange(0, 0.2, 1e-4)
    speed = 60 * np.sin(2 * np.pi * 8 * t_s) + 40 * t_s
    run = dqwatch.simulate(
        {"pole_pairs": 4}, None, {"shaft": "imposed", "control": "current", "speed_rad_s": speed}, noise=QUIET
    )
    assert len(run) == t_s.size
    assert np.abs(run["w_m_rad_s"] - speed).max() < 1e-9 * 60


def test_arrays_by_their_own_times() -> None:
    profile = {"shaft": "imposed", "control": "current", "t_s": [0.0, 0.03, 0.1], "speed_rad_s": [10.0, 40.0, -30.0]}
    run = dqwatch.simulate(profile=profile, noise=QUIET)
    expected = np.interp(run["t_s"], [0.0, 0.03, 0.1], [10.0, 40.0, -30.0])
    assert run["t_s"][-1] == pytest.approx(0.1, abs=2e-4)
    assert np.abs(run["w_m_rad_s"] - expected).max() < 1e-6


def test_load_accelerates_by_the_moment_of_inertia() -> None:
    load = np.linspace(0.0, 0.5, 2000)
    run = dqwatch.simulate(
        {"J_kgm2": 0.004, "B_Nms_rad": 0.0, "coulomb_Nm": 0.0},
        None,
        {"control": "voltage", "speed_start_rad_s": 100.0, "load_Nm": load, **NO_VOLTAGES},
        noise=QUIET,
    )
    dt_s = run["t_s"][1] - run["t_s"][0]
    # J dw = (torque - load) dt, summed as the simulator holds its load: over a period.
    torque = (run["torque_Nm"][:-1] + run["torque_Nm"][1:]) / 2
    moved = np.concatenate([[0.0], np.cumsum(torque - load[: torque.size])]) * dt_s / 0.004
    assert np.abs(run["w_m_rad_s"] - 100.0 - moved).max() < 0.02


def test_stepped_is_as_run() -> None:
    rng = np.random.default_rng(3)
    v_d, v_q = rng.uniform(-8, 8, 400), rng.uniform(-8, 8, 400)
    rest = {"control": "voltage", "shaft": "imposed", "speed_rad_s": 30.0}
    run = dqwatch.simulate(profile={**rest, "v_d_V": v_d, "v_q_V": v_q}, seed=5)
    drive = dqwatch.Simulation(profile={**rest, **NO_VOLTAGES}, seed=5)
    for a, b in zip(v_d, v_q, strict=True):
        drive.step(a, b)
    log = drive.log()
    for name, column in run.columns.items():
        assert (log[name] == column).all(), name


def test_a_locked_winding_decays_as_it_must() -> None:
    drive = dqwatch.Simulation(
        {"R_ohm": 0.5, "Ld_H": 1e-3, "Lq_H": 1e-3},
        profile={"shaft": "imposed", "speed_rad_s": 0.0},
        noise=QUIET,
    )
    rows = [drive.step(2.0, 0.0) for _ in range(300)]
    t_s = np.array([row.t_s for row in rows])
    expected = 4.0 * (1 - np.exp(-t_s * 0.5 / 1e-3))
    assert np.abs(np.array([row.i_d_A for row in rows]) - expected).max() < 1e-5
    assert drive.period_s == 1e-4 and drive.seen == rows[-1]


def test_a_controller_in_the_loop() -> None:
    drive = dqwatch.Simulation(profile={"shaft": "imposed", "speed_rad_s": 20.0}, noise=QUIET)
    truth = dqwatch.simulate(duration_s=0.01).truth
    row, integral = drive.seen, 0.0
    for _ in range(2000):
        error = 3.0 - row.i_q_A
        integral += 0.2 * error
        w_e = 4 * row.w_m_rad_s
        v_d = 3.0 * (0.0 - row.i_d_A) - w_e * truth["Lq_H"] * row.i_q_A
        row = drive.step(v_d, 3.0 * error + integral + w_e * truth["psi_Wb"])
    assert row.i_q_A == pytest.approx(3.0, abs=1e-3)
    # What it drew is a log.
    found = dqwatch.fit({n: c for n, c in drive.log().items()}, pole_pairs=4)
    assert found.rows_used == 2000


def test_the_links_limit_holds() -> None:
    drive = dqwatch.Simulation(profile={"shaft": "imposed", "speed_rad_s": 0.0}, noise=QUIET)
    row = drive.step(1e6, 0.0)
    assert np.hypot(row.v_d_V, row.v_q_V) == pytest.approx(320.0 / np.sqrt(3), rel=1e-9)


def test_groups_and_paths() -> None:
    run = dqwatch.simulate(
        {"R_ohm": 0.5, "coulomb_Nm": 0.1, "coulomb_width_rad_s": 1.0},
        {"modulation": "centred", "dead_time_s": 1e-6},
        nonideal={"turn_short": {"value": 0.02, "t_start_s": 0.0, "t_end_s": 0.01}, "turn_short_H": 1e-5},
        settings={"drive.i_max_A": 9.0, "profile.i_d_A": {"value": -1.0}},
        duration_s=0.01,
        seed=3,
    )
    assert run.truth["R_ohm"] == 0.5 and len(run) == 100
    assert run.to_dict()["seed"] == 3


def test_seed_repeats() -> None:
    one, two, three = (dqwatch.simulate(duration_s=0.02, seed=s) for s in (1, 1, 2))
    assert (one["i_q_A"] == two["i_q_A"]).all() and (one["i_q_A"] != three["i_q_A"]).any()


def test_polled() -> None:
    run = dqwatch.simulate(polled_Hz=20.0, duration_s=2.0)
    assert run.regime == "polled" and 20 <= len(run) <= 41


@pytest.mark.parametrize(
    "wrong",
    [
        {"scenario": "no_such"},
        {"machine": {"R_ohm": -1.0}},
        {"machine": {"no_such": 1.0}},
        {"machine": "/nowhere.toml"},
        {"inverter": "no_such"},
        {"profile": {"no_such": 1.0}},
        {"profile": {"load_Nm": [1.0, float("nan")]}},
        {"profile": {"load_Nm": []}},
        {"profile": {"load_Nm": [[1.0]]}},
        {"profile": {"load_Nm": ["a"]}},
        {"profile": {"load_Nm": [1.0, 2.0], "t_s": [0.0]}},
        {"profile": {"load_Nm": [1.0, 2.0], "t_s": [1.0, 0.0]}},
        {"settings": {"no.such": 1}},
        {"settings": {"machine.R_ohm": object()}},
        {"duration_s": -1.0},
        {"duration_s": 1e9},
    ],
)
def test_what_cannot_be_simulated(wrong: dict[str, object]) -> None:
    with pytest.raises(dqwatch.Error) as caught:
        dqwatch.simulate(**wrong)  # type: ignore[arg-type]
    assert "--" not in str(caught.value)


def test_steps_that_are_none() -> None:
    drive = dqwatch.Simulation()
    for bad in (float("nan"), float("inf")):
        with pytest.raises(dqwatch.UsageError, match="finite"):
            drive.step(bad, 0.0)
    with pytest.raises(dqwatch.UsageError):
        drive.step("1", 0.0)  # type: ignore[arg-type]
    drive.step(0.0, 0.0)
    with pytest.raises(dqwatch.UsageError):
        dqwatch.Simulation(settings={"drive.log_every": 2})


def test_lists() -> None:
    assert "servo" in dqwatch.scenarios() and "machine.R_ohm" in dqwatch.scenario_keys()
