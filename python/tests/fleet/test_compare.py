"""The comparison on fleets whose windows are drawn, not fitted: who is found, who is not, and what is told of types."""

import numpy as np
import pytest

from dqwatch.fleet.api import compared_table
from dqwatch.fleet.compare import compare
from dqwatch.fleet.simulated.drive import COPPER_PER_K, MAGNET_PER_K, REFERENCE_C
from dqwatch.fleet.simulated.planted import drawn
from dqwatch.fleet.simulated.short import SCATTER, windows
from dqwatch.fleet.simulated.write import wrongly_named
from dqwatch.fleet.windows import windows_of


def compared(*arguments, **named):
    fleet = drawn(*arguments, **named)
    return fleet, compare(windows_of(windows(fleet)))


@pytest.fixture(scope="module")
def whole():
    return compared(1, 600)


def test_the_planted_are_found_and_rightly_named(whole):
    fleet, c = whole
    wrong = wrongly_named(fleet, {s.motor: s.cause for s in c.standing})
    planted = sum(1 for m in fleet.members if m.planted)
    assert planted == 25
    missed = {m: x for m, x in wrong.items() if x[0]}
    false = {m: x for m, x in wrong.items() if not x[0]}
    assert len(missed) <= 1 and len(false) <= 1, wrong
    like = {s.motor: s.like for s in c.standing if s.cause == "other_type"}
    strangers = {m.name: m.motor.psi_Wb for m in fleet.members if m.planted == "other_type"}
    assert set(like) == set(strangers)


@pytest.mark.parametrize("seed", range(1, 5))
def test_of_healthy_fleets_hardly_one_motor_stands_out(seed):
    _fleet, c = compared(seed, 300, healthy=True)
    assert len(c.standing) <= 1, c.standing
    assert not c.unlike and not c.common
    # Deviations are promises: of what is healthy, z has deviation one.
    for o in c.of:
        if o.motors.size > 50:
            # Of the rest on d motors have no spread of their own, and no z is made larger for that.
            assert (0.85 if o.spread > 0 else 0.7) < np.std(o.z) < 1.2, (o.type, o.parameter)
            if np.any(np.isfinite(o.slope_z)):
                assert 0.8 < np.nanstd(o.slope_z) < 1.25, (o.type, o.parameter)


def test_types_are_told_at_one_temperature(whole):
    fleet, c = whole
    for o in c.of:
        if o.parameter not in ("R_ohm", "psi_Wb"):
            continue
        copper = o.parameter == "R_ohm"
        base = COPPER_PER_K if copper else MAGNET_PER_K
        relative = base / (1 + base * (o.temperature_C - REFERENCE_C))
        slope = o.slopes["per_K"]
        assert slope.value == pytest.approx(relative, abs=4 * slope.sd + 0.02 * abs(base))
        motors = [m.motor for m in fleet.members if m.said == o.type and not m.planted]
        truth = np.median([m.R_ohm if copper else m.psi_Wb for m in motors])
        truth *= 1 + base * (o.temperature_C - REFERENCE_C)
        assert o.value == pytest.approx(truth, rel=0.005)
        assert o.scale == pytest.approx(SCATTER[o.parameter] / (0.04 if copper else 0.004), rel=0.15)


def test_a_batch_is_named_as_such(whole):
    fleet, c = whole
    low = [m for m in fleet.members if m.planted == "batch"]
    found = [u for u in c.unlike if u.key == "batch"]
    assert [u.label for u in found] == [low[0].batch] and found[0].parameter == "psi_Wb"
    assert found[0].off == pytest.approx(np.log(0.96), abs=4 * found[0].sd)


def test_a_site_whose_supply_sags_is_no_fault_of_its_motors(whole):
    fleet, c = whole
    assert {(x.key, x.label, x.parameter) for x in c.common} == {("site", fleet.sagging_site, "dead_time_V")}
    change = np.array(c.common[0].change)
    assert np.mean(change[fleet.sag_week :]) - np.mean(change[: fleet.sag_week]) == pytest.approx(
        np.log(0.92), abs=0.02
    )
    at = {m.name for m in fleet.members if m.site == fleet.sagging_site and not m.planted}
    assert not at & {s.motor for s in c.standing}


def test_the_day_a_drift_crosses_is_in_its_interval():
    inside = total = 0
    for seed in range(1, 4):
        fleet, c = compared(seed, 200, each=3)
        spread = {(o.type, o.parameter): o for o in c.of}
        for s in c.standing:
            member = next(m for m in fleet.members if m.name == s.motor)
            if s.crossing is None or s.crossing[0] != "psi_Wb" or member.planted != "weak_magnet":
                continue
            # By the truth: its flux against the type's, in logarithms, over the weeks that were seen.
            weeks = np.arange(fleet.weeks)
            psi = np.log([member.week(w, fleet.weeks)[0].psi_Wb for w in weeks])
            slope, level = np.polyfit(7 * weeks, psi, 1)
            o = spread[s.type, "psi_Wb"]
            base = np.log(o.value / (1 + MAGNET_PER_K * (o.temperature_C - REFERENCE_C)))
            first = fleet.day(0).toordinal() - 719163
            at = first + (base + np.log(0.9) - level) / slope
            total += 1
            # The location is known to its own deviation, which the interval of one motor's line has no part of.
            slack = 3 * o.sd / abs(slope)
            inside += s.crossing[2] - slack <= at <= s.crossing[3] + slack
    assert total >= 5 and inside / total >= 0.85, (inside, total)


def test_motors_without_papers_are_one_type():
    fleet = drawn(1, 60, healthy=True)
    table = windows(fleet).drop_columns(["type", "batch", "axis", "site", "firmware"])
    c = compare(windows_of(table))
    assert {o.type for o in c.of} == {""}


def test_one_window_a_motor_is_compared_without_drifts():
    fleet = drawn(2, 120, weeks=1, healthy=True)
    c = compare(windows_of(windows(fleet)))
    assert c.of and all(not np.any(np.isfinite(o.slope_z)) for o in c.of)
    assert len(c.standing) <= 1


def test_nothing_is_compared_where_nothing_is():
    fleet = drawn(3, 3, weeks=1, healthy=True)
    c = compare(windows_of(windows(fleet)))
    assert c.of == [] and c.standing == [] and c.tests == 0


def test_the_table_of_all_motors_has_each_drift_and_its_day():
    fleet = drawn(4, 60, each=1, batch=5)
    w = windows_of(windows(fleet))
    c = compare(w)
    table = compared_table(w, c)
    assert table.num_rows == sum(o.motors.size for o in c.of)
    weak = next(m for m in fleet.members if m.planted == "weak_magnet")
    rows = [r for r in table.to_pylist() if r["parameter"] == "psi_Wb"]
    assert len(rows) == 60 and {r["type"] for r in rows} == {"H48", "J24", "S320"}
    mine = next(r for r in rows if r["motor"] == weak.name)
    # It loses size * (0.4 + 0.6 part) of its flux over seven weeks.
    assert mine["drift_week"] == pytest.approx(-0.6 * weak.size / 7, rel=0.15)
    last = w.day.max()
    at = last + 7 * (0.10 - weak.size) / (0.6 * weak.size / 7)
    assert mine["crosses_day"] == pytest.approx(at, abs=25) and mine["from_day"] < mine["crosses_day"] < mine["to_day"]
    assert abs(mine["drift_z"]) > 10 > 3 > np.median([abs(r["drift_z"]) for r in rows])
