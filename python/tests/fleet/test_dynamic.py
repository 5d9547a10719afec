"""Logs of single periods: what the monitor says of them is a column of their row; those that `dqwatch live` writes."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import dqwatch
import dqwatch.fleet
from dqwatch.fleet.sources import day_of

PERIOD_S = 5e-4
MACHINE = {
    "v_V": 14.0, "i_A": 6.0, "w_m_rad_s": 130.0, "pole_pairs": 4, "period_s": PERIOD_S,
    "R_ohm": 0.5, "Ld_H": 1e-3, "Lq_H": 1.4e-3, "psi_Wb": 0.02,
}  # fmt: skip
NAMES = ("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad")


def joint(duration_s, lost):
    nonideal = {"dead_time_V": 0.24, "dead_time_width_A": 0.05, "demagnetisation": lost}
    log = dqwatch.simulate(
        scenario="joint_24v", duration_s=duration_s, drive={"dt_s": PERIOD_S}, nonideal=nonideal, progress=False
    )
    return {n: np.asarray(log[n]) for n in NAMES}


@pytest.fixture(scope="module")
def failing():
    return joint(20.0, {"value": 0.06, "t_start_s": 10.0, "t_end_s": 10.1})


def test_events_of_the_monitor_are_in_a_row(failing, tmp_path):
    for name, log in (("healthy", joint(20.0, 0.0)), ("failing", failing)):
        pq.write_table(pa.table(log), tmp_path / f"{name}.parquet")
    windows = dqwatch.fleet(tmp_path, tmp_path / "out", threads=1).windows
    rows = {r["motor"]: r for r in windows.to_pylist()}
    assert {m: r["regime"] for m, r in rows.items()} == dict.fromkeys(rows, "dynamic")
    assert rows["failing"]["faults"] == ["demagnetisation"] and rows["healthy"]["faults"] == []
    assert [e.fault for e in dqwatch.monitor(failing, pole_pairs=4, progress=False).events] == ["demagnetisation"]


def test_a_log_that_the_monitor_refuses_is_fitted_all_the_same(failing, tmp_path, monkeypatch):
    def refuses(*_, **__):
        raise dqwatch.InputError("too short")

    pq.write_table(pa.table({n: x[:4000] for n, x in failing.items()}), tmp_path / "m.parquet")
    monkeypatch.setattr(dqwatch, "monitor", refuses)
    (row,) = dqwatch.fleet(tmp_path, tmp_path / "out", threads=1).windows.to_pylist()
    assert row["verdict"] == "good" and row["faults"] == [] and row["why"].endswith("not monitored: too short")


def test_the_machine_file_beside_parquet_stands(failing, tmp_path):
    pq.write_table(pa.table({n: x[:4000] for n, x in failing.items()}), tmp_path / "m.parquet")
    (tmp_path / "m.toml").write_text("[machine]\npole_pairs = 8\n")
    (row,) = dqwatch.fleet(tmp_path, tmp_path / "out", threads=1).windows.to_pylist()
    # The log's own speed and angle say four.
    assert row["pole_pairs"] == 8


def test_what_live_logs_the_fleet_reads(failing, tmp_path):
    from dqwatch.live.core import Live
    from dqwatch.live.motor import Motor, Settings
    from dqwatch.live.sinks.parquet import ParquetSink
    from dqwatch.live.sources import Source

    class Blocks:
        def __init__(self, name):
            table = np.column_stack([failing[n] for n in NAMES] + [np.full(len(failing["t_s"]), np.nan)] * 2)
            self.left = [(name, table[k : k + 1000]) for k in range(0, len(table), 1000)]

        def poll(self):
            return [self.left.pop(0)] if self.left else []

        def close(self):
            pass

    names = ("left wheel", "../<b>")
    sources = [Source(n, "test", lambda _, name=n: Blocks(name), []) for n in names]
    live = Live([Motor(Settings(n, MACHINE)) for n in names], sources, [ParquetSink(tmp_path / "log", 10**9)], None)
    # Two runs of the program: two files a motor.
    for turn in range(50):
        live.step(turn)
        if turn == 25:
            live.sinks[0].close()
    live.close(50.0)
    windows = dqwatch.fleet(tmp_path / "log", tmp_path / "out", threads=1).windows
    rows = windows.to_pylist()
    assert len({r["motor"] for r in rows}) == 2 and len(rows) == 4
    for r in rows:
        assert r["regime"] == "dynamic" and r["verdict"] == "good" and r["pole_pairs"] == 4, r["why"]
        assert r["Ld_H"] == pytest.approx(1e-3, rel=0.05) and r["Lq_H"] == pytest.approx(1.4e-3, rel=0.05)
    assert sorted(r["rows"] for r in rows) == [14_000, 14_000, 26_000, 26_000]
    assert [r["faults"] for r in rows if r["rows"] == 26_000] == [["demagnetisation"]] * 2


def test_the_number_of_a_row_is_no_date():
    assert day_of("000000020260105", 86400_000_000_000) == 1.0
    assert day_of("log20260105", 0) == day_of("2026-01-05", 0) == 20458.0
