"""Spark makes the rows that DuckDB makes, to the bit."""

import os
import shutil
import subprocess
import sys

import pyarrow.parquet as pq
import pytest

from dqwatch.fleet.store import Store
from dqwatch.fleet.work import Settings

# An environment of its own, with this package in it: DQW_SPARK_PYTHON names its Python.
PYTHON = os.environ.get("DQW_SPARK_PYTHON", sys.executable)


@pytest.fixture(scope="module")
def python():
    if not shutil.which("java"):
        pytest.skip("no java; openjdk-17-jre-headless")
    if subprocess.run([PYTHON, "-c", "import pyspark, dqwatch.fleet.spark"], capture_output=True).returncode:
        pytest.skip(
            "no pyspark; pip install './python[spark]' into an environment of its own, DQW_SPARK_PYTHON names it"
        )
    return PYTHON


def test_the_same_rows_to_the_bit(python, small, tmp_path):
    logs = tmp_path / "logs"
    for motor in ("M00001", "M00002"):
        shutil.copytree(small.logs / f"motor={motor}", logs / f"motor={motor}")
    shutil.copy(small.logs / "motors.csv", logs)
    folder = logs / "motor=M00002"
    whole = (folder / "2026-01-05.parquet").read_bytes()
    (folder / "2026-02-01.parquet").write_bytes(b"no Parquet")
    (folder / "2026-02-02.parquet").write_bytes(whole[:4] + b"\x55" * 4000 + whole[4004:])
    pq.write_table(
        pq.ParquetFile(folder / "2026-01-12.parquet").read().select(["t_s", "i_q_A"]), folder / "2026 ü 02.parquet"
    )
    for engine in ("spark", "duckdb"):
        run = subprocess.run(
            [python, "-m", "dqwatch", "fleet", str(logs), "--out", str(tmp_path / engine), "--engine", engine],
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, run.stderr[-3000:]
    ours, theirs = (Store(tmp_path / engine).table(Settings().digest()) for engine in ("duckdb", "spark"))
    assert ours.num_rows == 9
    for name in ours.column_names:
        assert ours[name].equals(theirs[name]), (name, ours[name].to_pylist(), theirs[name].to_pylist())
    assert (tmp_path / "spark" / "fleet.html").read_bytes() == (tmp_path / "duckdb" / "fleet.html").read_bytes()
