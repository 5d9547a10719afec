"""Logs as users have them: columns of other kinds, strange names and numbers, few of all; papers that change."""

import math
import os
import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import dqwatch.fleet
from dqwatch.fleet import run as runs
from dqwatch.fleet.sources import Source
from dqwatch.fleet.text import text_of


@pytest.fixture
def logs(small, tmp_path):
    """One motor of three weeks, and the papers."""
    shutil.copytree(small.logs / "motor=M00001", tmp_path / "logs" / "motor=M00001")
    shutil.copy(small.logs / "motors.csv", tmp_path / "logs")
    return tmp_path / "logs"


def first(logs):
    return pq.ParquetFile(logs / "motor=M00001" / "2026-01-05.parquet").read()


def ran(logs, **settings):
    return dqwatch.fleet(logs, logs.parent / "out", threads=1, **settings)


def rows_of(result):
    return {(r["motor"], r["window"]): r for r in result.windows.to_pylist()}


def put(logs, motor, table, name="2026-01-05.parquet"):
    folder = logs / f"motor={motor}"
    folder.mkdir(exist_ok=True)
    pq.write_table(table, folder / name)


def cast(table, kind):
    return pa.table({n: table[n].cast(kind) for n in table.column_names})


def test_a_log_of_texts_or_decimals_does_not_touch_its_neighbours(logs, small):
    t = first(logs)
    put(logs, "M00001", cast(t, pa.string()), "2026-02-01.parquet")
    put(
        logs,
        "M00001",
        pa.table({n: t[n].cast(pa.decimal128(30, 12), safe=False) for n in t.column_names}),
        "2026-02-02.parquet",
    )
    put(logs, "M00001", t.set_column(2, t.column_names[2], pa.nulls(t.num_rows, pa.float64())), "2026-02-03.parquet")
    put(logs, "M00001", cast(t, pa.float32()), "2026-02-04.parquet")
    rows = rows_of(ran(logs))
    known = rows_of(small.result)
    for day in ("2026-01-05", "2026-01-12", "2026-01-19"):
        assert rows["M00001", day]["psi_Wb"] == known["M00001", day]["psi_Wb"]
    assert rows["M00001", "2026-02-01"]["verdict"] == rows["M00001", "2026-02-03"]["verdict"] == "not_fitted"
    psi = known["M00001", "2026-01-05"]["psi_Wb"]
    assert rows["M00001", "2026-02-02"]["psi_Wb"] == pytest.approx(psi, rel=1e-6)
    assert rows["M00001", "2026-02-04"]["psi_Wb"] == pytest.approx(psi, rel=1e-3)


def test_names_are_texts_whatever_is_in_them(logs):
    t = first(logs)
    names = ["pump [1]", "ü 電機", "a'b\"c", "semi;--", "star*?", "new\nline", "\x1b[31mred", "=1+1"]
    for name in names:
        put(logs, name, t)
    put(logs, "M00001", t, "2026 [a] 'b'*.parquet")
    # No text in any encoding.
    bad = os.fsdecode(b"motor=\xff\xfe")
    (logs / bad).mkdir()
    shutil.copy(logs / "motor=M00001" / "2026-01-05.parquet", logs / bad / "2026-01-05.parquet")
    result = ran(logs)
    rows = rows_of(result)
    for name in names:
        assert rows[name, "2026-01-05"]["verdict"] == rows["M00001", "2026-01-05"]["verdict"], name
        assert rows[name, "2026-01-05"]["R_ohm"] is not None
        assert rows[name, "2026-01-05"]["R_ohm"] == rows[names[0], "2026-01-05"]["R_ohm"]
    assert rows["M00001", "2026 [a] 'b'*"]["psi_Wb"] == rows["M00001", "2026-01-05"]["psi_Wb"]
    (unnamed,) = (r for (motor, _), r in rows.items() if motor.startswith("\\xff"))
    assert (unnamed["verdict"], unnamed["why"]) == ("not_read", "its name is not UTF-8")
    assert "\x1b" not in text_of(result) and "\x1b" in "".join(m for m, _ in rows)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e300, 1e-300, 0.0, 1e12])
def test_numbers_that_cannot_be_are_rows_and_a_page(logs, value):
    t = first(logs)
    for k, name in enumerate(t.column_names):
        x = np.full(t.num_rows, value)
        put(logs, f"whole{k}", t.set_column(k, name, pa.array(x)))
        x = t[name].to_numpy().copy()
        x[17] = value
        put(logs, f"one{k}", t.set_column(k, name, pa.array(x)))
    result = ran(logs)
    assert result.windows.num_rows == 3 + 2 * len(t.column_names)
    assert set(result.windows["verdict"].to_pylist()) <= {"good", "weak", "nothing", "not_fitted"}
    assert all(r["why"] for r in result.windows.to_pylist() if r["verdict"] == "not_fitted")


def test_nothing_that_can_be_read_is_a_page_all_the_same(tmp_path):
    (tmp_path / "logs").mkdir()
    for k in range(6):
        (tmp_path / "logs" / f"{k}.parquet").write_bytes(b"PAR1")
    result = ran(tmp_path / "logs")
    assert result.windows["verdict"].to_pylist() == ["not_read"] * 6
    assert "None of 6 motors is compared" in result.page.read_text()
    text = text_of(result)
    assert "6 motors are not compared" in text and "no motors.csv names types" in text
    # Five of the reasons are said at once.
    assert text.count("not read: ") == 5 and "… 1 more on the page" in text and "0, 0: not read: " in text


def test_motors_of_one_window_are_compared_and_do_not_drift(small, tmp_path):
    for k in range(6):
        put(tmp_path, f"M{k}", pq.ParquetFile(small.logs / f"motor=M0000{k}" / "2026-01-05.parquet").read())
    result = dqwatch.fleet(tmp_path, tmp_path / "out", threads=1)
    assert result.windows.num_rows == 6 and result.comparison.alone == 0
    assert result.comparison.of and all(np.all(np.isnan(o.slope)) for o in result.comparison.of)
    assert "\n6 motors are not" not in text_of(result)


def test_fewer_than_five_of_a_type_are_said_to_be_not_compared(logs):
    result = ran(logs)
    assert result.comparison.alone == 1 and "1 motors are not compared" in text_of(result)
    assert "None of 1 motors is compared" in result.page.read_text()


def test_papers_that_change_are_followed(logs):
    before = ran(logs).windows
    psi, axes = before["psi_Wb"].to_pylist(), set(before["pole_pairs"].to_pylist())
    assert axes == {4.0}
    table = (logs / "motors.csv").read_text()
    (logs / "motors.csv").write_text(table.replace(",4,", ",8,"))
    again = ran(logs)
    assert again.new == 3 and again.windows.num_rows == 3
    assert again.windows["psi_Wb"].to_pylist() == pytest.approx([x / 2 for x in psi], rel=0.02)
    (logs / "motor=M00001" / "2026-01-12.toml").write_text('[log]\nregime = "steady"\n')
    by_file = ran(logs)
    assert by_file.new == 1 and by_file.windows["regime"].to_pylist() == ["polled", "steady", "polled"]
    # And back: what was found then is still there.
    (logs / "motor=M00001" / "2026-01-12.toml").unlink()
    (logs / "motors.csv").write_text(table)
    back = ran(logs)
    assert back.new == 0 and back.windows.equals(before)
    # What is no part of a fit is no reason for one.
    (logs / "motors.csv").write_text(table.replace("Aalen", "Ulm").replace("Brno", "Ulm"))
    assert ran(logs).new == 0


def test_a_machine_file_that_leaves_the_regime_open_leaves_it_to_the_rows(logs, small):
    (logs / "motors.csv").unlink()
    for day in ("2026-01-05", "2026-01-12"):
        (logs / "motor=M00001" / f"{day}.toml").write_text("[machine]\npole_pairs = 4\n")
    (logs / "motor=M00001" / "2026-01-12.toml").write_text("no table\n")
    rows, known = rows_of(ran(logs)), rows_of(small.result)
    for p in ("regime", "psi_Wb", "psi_Wb_sd", "R_ohm", "pole_pairs"):
        assert rows["M00001", "2026-01-05"][p] == known["M00001", "2026-01-05"][p], p
    assert rows["M00001", "2026-01-12"]["verdict"] == "not_fitted" and "toml" in rows["M00001", "2026-01-12"]["why"]


def test_a_file_that_could_not_be_opened_is_read_once_it_can(logs, monkeypatch):
    content = Source.content

    def shut(self):
        if self.window == "2026-01-12":
            raise PermissionError(13, "Permission denied")
        return content(self)

    with monkeypatch.context() as m:
        m.setattr(Source, "content", shut)
        m.setattr(Source, "opens", property(lambda self: self.window != "2026-01-12"))
        row = rows_of(ran(logs))["M00001", "2026-01-12"]
        assert row["verdict"] == "not_read" and "Permission denied" in row["why"]
        assert ran(logs).new == 0
    result = ran(logs)
    assert result.new == 1 and result.windows.num_rows == 3
    assert rows_of(result)["M00001", "2026-01-12"]["source_hash"]
    assert ran(logs).new == 0


def test_a_log_that_became_worse_is_told_as_it_is(logs):
    ran(logs)
    path = logs / "motor=M00001" / "2026-01-12.parquet"
    path.write_bytes(path.read_bytes()[:2000])
    os.utime(path, ns=(2 * 10**18,) * 2)
    result = ran(logs)
    assert result.new == 1 and rows_of(result)["M00001", "2026-01-12"]["verdict"] == "not_read"


def test_more_rows_than_memory_and_disk_take_says_so(logs, monkeypatch):
    def too_large(*_):
        raise runs.duck.TooLarge("out of memory")

    monkeypatch.setattr(runs.duck, "windows", too_large)
    assert all("--memory" in r["why"] for r in ran(logs).windows.to_pylist())


def test_a_name_in_the_tables_is_no_formula(tmp_path):
    from dqwatch.fleet.api import write_tables
    from dqwatch.fleet.compare import Comparison, Sign, Standing

    sign = Sign("psi_Wb", "level", -0.1, 0.01, -10.0, 1e-9)
    standing = [Standing("=cmd|' /C calc'!A0", "@T", "weak_magnet", "", (), (sign,))]
    write_tables(None, Comparison([], standing, [], [], 1, {}, []), tmp_path)
    line = (tmp_path / "standing.csv").read_text().splitlines()[1]
    assert line.startswith("'=cmd|' /C calc'!A0,'@T,weak_magnet,") and ",psi_Wb,level,-0.1,0.01,-10.0," in line


def test_a_copy_of_a_log_counts_once(logs, small):
    for day in ("10", "11", "12"):
        shutil.copy(logs / "motor=M00001" / "2026-01-05.parquet", logs / "motor=M00001" / f"2026-02-{day}.parquet")
    rows = rows_of(ran(logs))
    known = rows_of(small.result)["M00001", "2026-01-05"]
    assert rows["M00001", "2026-01-05"]["R_ohm"] == known["R_ohm"]
    for day in ("10", "11", "12"):
        copy = rows["M00001", f"2026-02-{day}"]
        assert copy["verdict"] == "nothing" and copy["R_ohm"] is None and copy["R_ohm_sd"] is None
        assert copy["why"] == "a copy of motor=M00001/2026-01-05.parquet: its rows count once"
    # The same rows of another motor are its own.
    put(logs, "M00002", first(logs))
    assert rows_of(ran(logs))["M00002", "2026-01-05"]["verdict"] != "nothing"
