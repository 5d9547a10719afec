"""What a fleet's windows lack: temperatures, motors of a firmware, rows; none of it silences what the others tell."""

import math

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pytest

from dqwatch.fleet.compare import compare, left_out
from dqwatch.fleet.robust import crossing
from dqwatch.fleet.simulated.drive import Wire, Wrong, polled_log
from dqwatch.fleet.simulated.planted import TYPES
from dqwatch.fleet.text import due_text
from dqwatch.fleet.windows import D_AXIS, GROUPS, PARAMETERS, Windows
from dqwatch.fleet.work import Settings, channels, window_row

DAY = 20000.0


def of(values, temperature_C=None, firmware=None):
    """Windows of one type, a row a motor, a column a week. values: by parameter, with their deviations."""
    motors, weeks = next(iter(values.values()))[0].shape
    count = motors * weeks
    nothing = {p: np.full(count, np.nan) for p in (*PARAMETERS, D_AXIS)}
    group = {g: np.full(motors, -1, dtype=np.intp) for g in GROUPS} | {"type": np.zeros(motors, dtype=np.intp)}
    labels = {g: [] for g in GROUPS} | {"type": ["T"]}
    if firmware is not None:
        group["firmware"], labels["firmware"] = np.asarray(firmware, dtype=np.intp), ["a", "b"]
    nan = np.full(count, np.nan)
    return Windows(
        [f"m{k:03d}" for k in range(motors)],
        np.repeat(np.arange(motors), weeks),
        np.tile(DAY + 7.0 * np.arange(weeks), motors),
        nothing | {p: x.ravel() for p, (x, _s) in values.items()},
        nothing | {p: np.broadcast_to(s, x.shape).ravel() for p, (x, s) in values.items()},
        {p: np.ones(count) for p in nothing},
        nan if temperature_C is None else temperature_C.ravel(),
        nan,
        nan,
        group,
        labels,
        np.full(motors, 5.0),
    )


def warm_and_cold(rng, motors=40, weeks=12):
    T = 25 + rng.normal(0, 4, (motors, 1)) + 20 * np.sin(np.arange(weeks) / 2) * rng.uniform(0, 1, (motors, 1))
    T[7] += 45
    R = 0.3 * np.exp(rng.normal(0, 0.01, (motors, 1)) + rng.normal(0, 0.004, (motors, weeks)))
    return T, R * (1 + 0.00393 * (T - 25))


def test_one_window_without_temperature_leaves_the_others_corrected():
    T, R = warm_and_cold(np.random.default_rng(1))
    psi = 0.015 * np.exp(np.random.default_rng(6).normal(0, 0.004, (40, 12))) * (1 - 0.001 * (T - 25))
    T[3, 5] = np.nan
    c = compare(of({"R_ohm": (R, 0.02 * R), "psi_Wb": (psi, 0.005 * psi)}, T))
    assert c.standing == []
    # Found, not copper's: magnets have no slope but what is found.
    slopes = {o.parameter: o.slopes["per_K"] for o in c.of}
    assert slopes["R_ohm"].value == pytest.approx(0.0039, abs=0.0003) and slopes["R_ohm"].sd > 0
    assert slopes["psi_Wb"].value == pytest.approx(-0.001, abs=0.0002)
    assert math.isfinite(c.of[0].temperature_C)
    assert c.uncorrected["temperature"] == 1 and any(x.startswith("1 windows") for x in left_out(c))


def test_a_motor_without_temperatures_is_as_wide_as_heat_makes_it():
    T, R = warm_and_cold(np.random.default_rng(2))
    lacking = [7, 8, 9]
    known = T.copy()
    known[lacking] = np.nan
    c = compare(of({"R_ohm": (R, 0.02 * R)}, known))
    o = c.of[0]
    assert c.standing == [] or 7 in [int(s.motor[1:]) for s in c.standing]
    spread_K = 1.4826 * np.nanmedian(np.abs(known - np.nanmedian(known)))
    for m in lacking:
        assert o.off_sd[m] == pytest.approx(o.slopes["per_K"].value * spread_K, rel=0.25)
    assert np.median(o.off_sd) < 0.2 * o.off_sd[8]
    assert c.uncorrected["temperature"] == 36


def test_rows_without_a_value_blank_no_window():
    table = pa.table({"t_s": [0.0, 1.0, 2.0], "temp_winding_C": [20.0, np.nan, 40.0], "i_q_A": [3.0, np.nan, 3.0]})
    row = window_row(table, Settings(), {}, motor="m", window="w")
    assert row["temp_winding_C"] == 30.0 and row["i_rms_A"] == pytest.approx(3.0)


def test_a_value_near_zero_is_told_without_bias():
    z = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        c = compare(of({"dead_time_V": (0.02 + rng.normal(0, 0.03, (40, 12)), 0.03)}))
        o = c.of[0]
        assert o.window.size == 480, "negative values are values"
        # By the drawn windows' deviation, not the comparison's own.
        z.append((o.value - 0.02) / (0.03 / np.sqrt(480)))
        assert c.standing == []
    assert abs(np.mean(z)) < 0.5


def test_noisy_motors_are_not_high_for_being_noisy():
    bias, own = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        s = 0.3 * np.repeat([0.3, 0.01], 20)[:, None]
        R = 0.3 * np.exp(rng.normal(0, 0.01, (40, 1))) + s * rng.normal(0, 1, (40, 12))
        o = compare(of({"R_ohm": (R, s)})).of[0]
        bias.append(np.mean(o.off[:20]))
        own.append(np.mean(o.off_sd[:20]))
    assert abs(np.mean(bias)) < 0.5 * np.mean(own)
    assert abs(np.mean(bias)) < 3 * np.mean(own) / np.sqrt(8 * 20)


def high_r(firmware):
    rng = np.random.default_rng(3)
    R = 0.3 * np.exp(rng.normal(0, 0.02, (40, 1)) + rng.normal(0, 0.01, (40, 8)))
    R[36] *= 1.6
    return compare(of({"R_ohm": (R, 0.02 * R)}, firmware=firmware))


def test_motors_of_a_rare_firmware_are_compared():
    c = high_r([0] * 36 + [1] * 4)
    assert [s.motor for s in c.standing] == ["m036"] and c.not_compared == []
    assert c.of[0].motors.size == 40


def test_motors_of_a_firmware_that_no_other_has_are_listed_where_nothing_tells_between():
    c = high_r([0] * 36 + [1] + [0] * 3)
    assert c.not_compared == [("m036", "R_ohm")]
    assert any("m036" in line and "R_ohm" in line for line in left_out(c))


def test_a_drift_that_is_past_its_limit_says_so():
    at, low, high = crossing(-0.15, 0.001, -0.001, 1e-5, -0.1)
    assert at == pytest.approx(-50) and low < -50 < high < 0
    rng = np.random.default_rng(4)
    psi = 0.015 * np.exp(rng.normal(0, 0.004, (40, 1)) + rng.normal(0, 0.001, (40, 8)))
    psi[3] *= 1 - np.linspace(0.14, 0.30, 8)
    psi[4] *= 1 - np.linspace(0.02, 0.24, 8)
    c = compare(of({"psi_Wb": (psi, 0.004 * psi)}))
    found = {s.motor: s for s in c.standing}
    assert found["m003"].crossing == ("psi_Wb", -np.inf, -np.inf, DAY)
    assert "before the first window" in due_text(found["m003"])
    # By its own line: 8 of 22 parts on the way.
    assert found["m004"].crossing[1] == pytest.approx(DAY + 49 * 8 / 22, abs=5)


def test_a_csv_gives_what_parquet_gives(tmp_path):
    rng = np.random.default_rng(5)
    m = TYPES["H48"]
    table = pa.table(polled_log(m, Wrong(), Wire(), rng, 400, 30.0, m.v_dc_V))
    pyarrow.csv.write_csv(channels(table), tmp_path / "log.csv")
    papers = {"pole_pairs": str(m.pole_pairs)}
    of_table = window_row(channels(table), Settings(), papers, motor="m", window="w")
    of_text = window_row(str(tmp_path / "log.csv"), Settings(), papers, motor="m", window="w")
    assert of_text["regime"] == "polled" and of_table["verdict"] == "good"
    for name in ("temp_winding_C", "v_dc_V", "i_rms_A", "w_rms_rad_s", "rows", "R_ohm", "psi_Wb"):
        assert of_table[name] is not None and of_text[name] == pytest.approx(of_table[name], rel=1e-5), name
    (tmp_path / "log.toml").write_text('[log]\nregime = "dynamic"\n')
    assert window_row(str(tmp_path / "log.csv"), Settings(), papers, motor="m", window="w")["regime"] != "polled"
