"""What each cause moves, by a motor's own log and the fit, not by the table of causes."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from dqwatch.fleet.naming import CAUSES, SAYS, named
from dqwatch.fleet.simulated.drive import Wire, Wrong, polled_log
from dqwatch.fleet.simulated.planted import TYPES
from dqwatch.fleet.windows import D_AXIS
from dqwatch.fleet.work import Settings, channels, window_row

M = TYPES["H48"]
CASES = {
    "weak_magnet": (dataclasses.replace(M, psi_Wb=0.9 * M.psi_Wb), Wrong()),
    "winding": (dataclasses.replace(M, R_ohm=1.15 * M.R_ohm), Wrong()),
    "inductance": (dataclasses.replace(M, Lq_H=1.1 * M.Lq_H, Ld_H=1.1 * M.Ld_H), Wrong()),
    "inverter": (dataclasses.replace(M, dead_time_V=1.5 * M.dead_time_V), Wrong()),
    "current_sensor": (M, Wrong(current_gain=1.1)),
    "voltage_sensor": (M, Wrong(voltage_gain=1.1)),
    "encoder_scale": (M, Wrong(speed_gain=1.1)),
    "encoder_zero": (M, Wrong(angle_rad=0.1)),
}


def logarithms(m, wrong):
    """Of the parameters that the fit gives of one log; its deviations are those of a fleet: parts in a hundred."""
    table = channels(pa.table(polled_log(m, wrong, Wire(), np.random.default_rng(1), 2000, 30.0, m.v_dc_V)))
    row = window_row(table, Settings(), {"pole_pairs": str(m.pole_pairs)}, motor="M", window="w")
    found = {p: np.log(row[p]) for p in ("R_ohm", "Lq_H", "psi_Wb", "dead_time_V") if row[p]}
    return found | {D_AXIS: np.log(row["residual_d_percent"])}


@pytest.fixture(scope="module")
def healthy():
    return logarithms(M, Wrong())


@pytest.mark.parametrize("name", CASES)
def test_a_cause_is_named_by_what_it_does_to_a_log(healthy, name):
    now = logarithms(*CASES[name])
    off = {p: now[p] - healthy[p] for p in now}
    sd = {p: 0.15 if p == D_AXIS else 0.015 for p in off}
    verdict = named([(off, sd)])
    assert verdict.name == name, off
    cause = next(c for c in CAUSES if c.name == name)
    if not cause.frees:
        for p in off:
            if p != D_AXIS:
                # A tenth of the change: dead time is no part of the currents' gain, R only nearly none of the flux'.
                assert off[p] == pytest.approx(cause.moves.get(p, 0.0) * verdict.amount, abs=0.03), (p, off)


def test_what_no_cause_explains_is_unknown():
    off = {"R_ohm": 0.3, "psi_Wb": 0.2, "Lq_H": -0.25, "dead_time_V": 0.0}
    assert named([(off, dict.fromkeys(off, 0.01))]).name == "unknown"


def test_what_two_causes_explain_names_both():
    off = {"Lq_H": 0.05}
    verdict = named([(off, {"Lq_H": 0.01})])
    assert {verdict.name, *verdict.also} >= {"inductance", "current_sensor"}


@pytest.mark.parametrize(
    ("off", "could"),
    [
        ({"psi_Wb": -0.1}, {"weak_magnet", "encoder_scale", "voltage_sensor"}),
        ({"R_ohm": 0.4}, {"winding", "current_sensor", "voltage_sensor"}),
        ({"R_ohm": 0.4, "psi_Wb": 0.0}, {"winding", "current_sensor"}),
        ({"Lq_H": -0.2}, {"inductance", "current_sensor", "voltage_sensor", "encoder_scale"}),
    ],
)
def test_causes_that_nothing_measured_tells_apart_are_unknown_and_listed(off, could):
    verdict = named([(off, dict.fromkeys(off, 0.01))])
    assert verdict.name == "unknown" and set(verdict.also) == could
    assert verdict.says != SAYS["unknown"]


def test_what_is_measured_alone_is_named_and_no_text_speaks_of_more():
    off = {"psi_Wb": -0.1, "Lq_H": 0.0}
    verdict = named([(off, dict.fromkeys(off, 0.01))])
    assert verdict.name == "weak_magnet"
    off = {"R_ohm": -0.1, "Lq_H": -0.1, "psi_Wb": 0.0}
    verdict = named([(off, dict.fromkeys(off, 0.01))])
    assert verdict.name == "current_sensor"
    assert "L_q" in verdict.says and "flux" in verdict.says and "L_d" not in verdict.says
    off = {"psi_Wb": 0.1, "Ld_H": 0.1, "dead_time_V": 0.0}
    verdict = named([(off, dict.fromkeys(off, 0.01))])
    assert verdict.name == "encoder_scale"
    assert "L_d" in verdict.says and " R" not in verdict.says and "L_q" not in verdict.says


def test_heat_is_listed_where_no_temperature_is_known_and_r_rose():
    off = {"R_ohm": 0.2, "Lq_H": 0.0, "psi_Wb": 0.0, "dead_time_V": 0.0}
    sd = dict.fromkeys(off, 0.01)
    assert "heat" in named([(off, sd)], temperature_known=False).also
    assert "heat" not in named([(off, sd)]).also
    assert "heat" not in named([(off | {"R_ohm": -0.2}, sd)], temperature_known=False).also


def test_a_drift_the_other_way_breaks_no_tie():
    levels, drifts = {"R_ohm": 0.2}, {"R_ohm": -0.004}
    verdict = named([(levels, {"R_ohm": 0.01}), (drifts, {"R_ohm": 0.01})])
    assert verdict.name == "unknown" and "winding" in verdict.also
