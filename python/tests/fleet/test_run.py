"""Runs: one row a motor and window, new files only, killed and gone on, two at once, files that cannot be read."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import dqwatch
import dqwatch.fleet
from dqwatch.fleet import run as runs
from dqwatch.fleet.sources import day_of, papers_of, sources
from dqwatch.fleet.store import Store, depends_on
from dqwatch.fleet.work import PARAMETERS, SCHEMA, Settings


def rows_of(out):
    return Store(out).table(Settings().digest())


def start(logs, out):
    return subprocess.Popen(
        [sys.executable, "-m", "dqwatch", "fleet", str(logs), "--out", str(out), "--threads", "1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_each_window_is_what_fit_says_of_its_log(small):
    table = small.result.windows
    assert table.num_rows == 18 and small.result.new == 18
    path = small.logs / "motor=M00001" / "2026-01-12.parquet"
    alone = dqwatch.fit(pq.ParquetFile(path).read(), pole_pairs=4, machine={"log": {"regime": "polled"}})
    row = next(r for r in table.to_pylist() if r["motor"] == "M00001" and r["window"] == "2026-01-12")
    for p in PARAMETERS:
        assert row[p] == (alone.parameters[p].value if p in alone.parameters else row[p])
    assert row["psi_Wb"] == alone.parameters["psi_Wb"].value and row["psi_Wb_sd"] == alone.parameters["psi_Wb"].sd
    assert row["psi_Wb_usable"] == alone.parameters["psi_Wb"].usable
    assert row["rows"] == 400 and 100 < row["rows_used"] < 400
    assert day_of("2026-01-12", 0) == row["day"] == 20465.0


def test_a_second_run_reads_nothing_and_writes_the_same(small):
    page = (small.out / "fleet.html").read_bytes()
    parts = [p.name for p in Store(small.out).parts()]
    again = dqwatch.fleet(small.logs, small.out)
    assert again.new == 0
    assert (small.out / "fleet.html").read_bytes() == page
    assert [p.name for p in Store(small.out).parts()] == parts


def test_new_files_only(small, tmp_path):
    logs = tmp_path / "logs"
    shutil.copytree(small.logs, logs)
    late = logs / "motor=M00003" / "2026-01-19.parquet"
    late.rename(tmp_path / "late.parquet")
    assert dqwatch.fleet(logs, tmp_path / "out").new == 17
    (tmp_path / "late.parquet").rename(late)
    result = dqwatch.fleet(logs, tmp_path / "out")
    assert result.new == 1 and result.windows.num_rows == 18
    mine, whole = (t.drop_columns(["source_mtime_ns"]) for t in (result.windows, small.result.windows))
    assert mine.equals(whole)


def test_a_log_that_was_replaced_counts_once(small, tmp_path):
    logs = tmp_path / "logs"
    shutil.copytree(small.logs / "motor=M00001", logs / "motor=M00001")
    dqwatch.fleet(logs, tmp_path / "out")
    path = logs / "motor=M00001" / "2026-01-12.parquet"
    pq.write_table(pq.ParquetFile(path).read().slice(0, 300), path)
    os.utime(path, ns=(time.time_ns() + 10**9,) * 2)
    table = dqwatch.fleet(logs, tmp_path / "out").windows
    assert table.num_rows == 3
    assert [
        r for r, w in zip(table["rows"].to_pylist(), table["window"].to_pylist(), strict=False) if w == "2026-01-12"
    ] == [300]


def test_what_cannot_be_read_is_a_row_and_stops_nothing(small, tmp_path):
    logs = tmp_path / "logs"
    shutil.copytree(small.logs / "motor=M00002", logs / "motor=M00002")
    shutil.copy(small.logs / "motors.csv", logs)
    folder = logs / "motor=M00002"
    (folder / "2026-02-01.parquet").write_bytes(b"no Parquet")
    whole = (folder / "2026-01-05.parquet").read_bytes()
    # Its footer is right, its pages are not.
    (folder / "2026-02-02.parquet").write_bytes(whole[:4] + b"\x55" * 4000 + whole[4004:])
    pq.write_table(pa.table({"t_s": pa.array([], pa.float64())}), folder / "2026-02-03.parquet")
    pq.write_table(pa.table({"t_s": [0.0, 1.0], "i_q_A": [1.0, 2.0]}), folder / "2026-02-04.parquet")
    (folder / "2026-02-05.csv").write_text("this,is\nno,log\n")
    os.symlink(tmp_path / "nowhere", folder / "2026-02-06.parquet")
    table = dqwatch.fleet(logs, tmp_path / "out").windows
    said = {r["window"]: (r["verdict"], r["why"]) for r in table.to_pylist()}
    assert len(said) == 9
    healthy = {r["window"]: r["verdict"] for r in small.result.windows.to_pylist() if r["motor"] == "M00002"}
    assert {w: said[w][0] for w in healthy} == healthy and "good" in healthy.values()
    assert said["2026-02-01"][0] == "not_read" and "arquet" in said["2026-02-01"][1]
    assert said["2026-02-02"] == ("not_read", "its pages cannot be read to the end")
    assert said["2026-02-03"] == ("not_read", "no rows")
    assert said["2026-02-04"][0] == "not_fitted" and "v_" in said["2026-02-04"][1]
    assert said["2026-02-05"][0] == "not_fitted" and "2026-02-05.csv:1" in said["2026-02-05"][1]
    assert said["2026-02-06"][0] == "not_read" and "No such file" in said["2026-02-06"][1]


def test_one_file_of_many_motors_is_as_many_files(small, tmp_path):
    tables = []
    for path in sorted(small.logs.glob("motor=*/*.parquet")):
        t = pq.ParquetFile(path).read()
        for name, text in (("motor", path.parent.name[6:]), ("window", path.stem)):
            t = t.append_column(name, pa.array([text] * t.num_rows))
        tables.append(t)
    logs = tmp_path / "logs"
    logs.mkdir()
    shutil.copy(small.logs / "motors.csv", logs)
    # Rows of all motors in turn: one after another in time.
    whole = pa.concat_tables(tables)
    pq.write_table(whole.take(pa.array([k + 400 * j for k in range(400) for j in range(18)])), logs / "all.parquet")
    table = dqwatch.fleet(logs, tmp_path / "out", memory="256MiB").windows
    assert table.num_rows == 18
    for name in ("motor", "window", "day", *PARAMETERS, "psi_Wb_sd", "rows_used", "i_rms_A", "batch"):
        assert table[name].equals(small.result.windows[name]), name


def test_files_of_unlike_columns_are_read_together(small, tmp_path):
    folder = tmp_path / "motor=M00001"
    shutil.copytree(small.logs / "motor=M00001", folder)
    shutil.copy(small.logs / "motors.csv", tmp_path)
    t = [0.001 * k for k in range(4000)]
    torque = [0.2 if k // 500 % 2 else -0.2 for k in range(4000)]
    speed = [0.0]
    for x in torque[:-1]:
        speed.append(speed[-1] + 0.001 * (x - 1e-3 * speed[-1]) / 1e-3)
    pq.write_table(pa.table({"t_s": t, "torque_Nm": torque, "w_m_rad_s": speed}), folder / "2026-01-12-coast.parquet")
    rows = {r["window"]: r for r in dqwatch.fleet(tmp_path, tmp_path / "out").windows.to_pylist()}
    assert rows["2026-01-12-coast"]["regime"] == "mechanical"
    assert rows["2026-01-12-coast"]["J_kgm2"] == pytest.approx(1e-3, rel=0.01)
    known = next(r for r in small.result.windows.to_pylist() if (r["motor"], r["window"]) == ("M00001", "2026-01-12"))
    assert rows["2026-01-12"]["psi_Wb"] == known["psi_Wb"]


def test_a_killed_run_goes_on(small, tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "_PART_FILES", 2)
    out = tmp_path / "out"
    store, found = Store(out), sources(small.logs)
    papers = papers_of(small.logs, None)

    class Killed(BaseException):
        pass

    def told(done, new):
        if done >= 6:
            raise Killed

    with pytest.raises(Killed):
        runs.run(store, found, Settings(), papers, "1GB", 1, told)
    kept = {p.name: p.stat().st_mtime_ns for p in store.parts()}
    assert len(kept) == 3
    # What a kill leaves: half a part, and a claim whose holder is gone.
    (store.windows / ".half.part").write_bytes(b"PAR1")
    dead = subprocess.Popen(["true"])
    dead.wait()
    left = store.new(found, Settings().digest(), papers)
    claim = store.claims / f"{store.part_name(left[:2], depends_on(Settings().digest(), papers))}.json"
    claim.write_text(f'{{"host": "{os.uname().nodename}", "pid": {dead.pid}}}')
    assert runs.run(store, found, Settings(), papers, "1GB", 1) == 12
    assert kept.items() <= {p.name: p.stat().st_mtime_ns for p in store.parts()}.items()
    assert not list(store.claims.iterdir())
    assert rows_of(out).equals(rows_of(small.out))


def test_a_run_that_is_killed_by_the_system_goes_on(small, tmp_path):
    first = start(small.logs, tmp_path / "out")
    windows = tmp_path / "out" / "claims"
    for _ in range(600):
        if first.poll() is not None or (windows.is_dir() and list(windows.iterdir())):
            break
        time.sleep(0.05)
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert dqwatch.fleet(small.logs, tmp_path / "out").windows.equals(small.result.windows)


def test_two_runs_at_once_do_not_harm_each_other(small, tmp_path):
    both = [start(small.logs, tmp_path / "out") for _ in range(2)]
    said = [p.communicate(timeout=300) for p in both]
    assert [p.returncode for p in both] == [0, 0], said
    assert rows_of(tmp_path / "out").equals(rows_of(small.out))
    assert (tmp_path / "out" / "fleet.html").read_bytes() == (small.out / "fleet.html").read_bytes()
    assert len(Store(tmp_path / "out").parts()) == 1


def test_a_living_claim_is_left_alone(tmp_path):
    store = Store(tmp_path)
    with store.claimed("part") as mine:
        assert mine
        with Store(tmp_path).claimed("part") as other:
            assert not other
    with store.claimed("part") as mine:
        assert mine


def test_windows_of_csv_files_and_folders(small, tmp_path):
    folder = tmp_path / "pump 7"
    folder.mkdir()
    t = pq.ParquetFile(small.logs / "motor=M00001" / "2026-01-12.parquet").read()
    names = t.column_names
    (folder / "2026-03-01 a.csv").write_text(
        "\n".join(
            [
                ",".join(names),
                *(",".join(map(repr, row)) for row in zip(*(t[n].to_pylist() for n in names), strict=False)),
            ]
        )
    )
    (tmp_path / "motors.csv").write_text("motor,type,pole_pairs\npump 7,J24,4\n")
    table = dqwatch.fleet(tmp_path, tmp_path.parent / "out", regime="polled").windows
    row = table.to_pylist()[0]
    assert (row["motor"], row["window"], row["verdict"]) == ("pump 7", "2026-03-01 a", "good")
    known = next(r for r in small.result.windows.to_pylist() if (r["motor"], r["window"]) == ("M00001", "2026-01-12"))
    assert row["psi_Wb"] == pytest.approx(known["psi_Wb"], rel=1e-9)


def test_the_schema_has_what_is_promised():
    assert {"motor", "window", "verdict", "why", "faults", "rows_used", "R_ohm", "R_ohm_sd", "R_ohm_usable"} <= set(
        SCHEMA.names
    )


@pytest.mark.parametrize(
    "arguments, says",
    [
        (["nowhere"], "nowhere: no logs"),
        ([".", "--memory", "much"], "expected a number and a unit"),
        ([".", "--memory", "infGB"], "expected a number and a unit"),
        ([".", "--threads", "-2"], "--threads -2: expected a number from 1 on"),
        ([".", "--out", "a.csv"], "a.csv"),
    ],
)
def test_refusals_are_one_line(tmp_path, arguments, says, capsys):
    from dqwatch.fleet.main import main

    (tmp_path / "a.csv").write_text("t_s\n")
    here = os.getcwd()
    os.chdir(tmp_path)
    try:
        assert main(["--out", "out", *arguments]) == 3
    finally:
        os.chdir(here)
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1


def test_a_table_of_motors_that_cannot_be_is_refused(tmp_path):
    (tmp_path / "motors.csv").write_text("motor,type\nA,x\nA,y\n")
    with pytest.raises(ValueError, match=r"motors.csv:3: motor A a second time"):
        papers_of(tmp_path, None)
