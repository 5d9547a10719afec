"""`dqwatch live CONFIG.toml` as a program: it ends when told, goes on when killed, and refuses in one line."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from joints import MACHINE

CONFIG = """[live]
state = "state"
[motor.m]
machine = {{ {machine} }}
[[source]]
kind = "file"
path = "log.csv"
format = "csv"
motor = "m"
"""
LOG = """[[sink]]
kind = "parquet"
folder = "log"
"""


def start(config: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", "import sys; from dqwatch.live import main; sys.exit(main(sys.argv[1:]))"]
    return subprocess.Popen(
        [*command, str(config), "--no-page"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def saved(folder: Path) -> dict[str, object]:
    path = folder / "state" / "m.state"
    if not path.exists():
        return {}
    head: dict[str, object] = json.loads(path.read_bytes().split(b"\n")[1])
    return head


def test_killed_and_begun_again_as_a_program(failing: Path, tmp_path: Path) -> None:
    from test_live_sources import wait_for

    config = tmp_path / "live.toml"
    config.write_text(CONFIG.format(machine=", ".join(f"{k} = {v!r}" for k, v in MACHINE.items())) + LOG)
    lines = failing.read_text().splitlines(keepends=True)
    log = tmp_path / "log.csv"
    # The fault is in the first part: its event is saved as it is named.
    log.write_text("".join(lines[:24_001]))
    first = start(config)
    wait_for(lambda: saved(tmp_path).get("event_count") == 1, 120)
    first.kill()
    first.communicate()
    with log.open("a") as file:
        file.write("".join(lines[24_001:]))
    second = start(config)
    rows = len(lines) - 1
    # It saves when it ends; what it has read by then is for it to say.
    wait_for(lambda: saved(tmp_path).get("counts", {}).get("rows") == rows, 120)  # type: ignore[attr-defined]
    second.send_signal(signal.SIGTERM)
    out, err = second.communicate(timeout=300)
    assert second.returncode == 0, err
    # The log has every row once: also those of the time between the last state and the kill.
    files = sorted((tmp_path / "log" / "motor=m").glob("*.parquet"))
    times = np.concatenate([pq.read_table(f)["t_s"].to_numpy() for f in files])
    assert len(times) == rows and np.all(np.diff(times) > 0)
    assert "1 of 1 motors go on where they were" in out
    assert f"m: {rows} rows, 1 events" in out and "demagnetisation" in out
    assert saved(tmp_path)["event_count"] == 1


def test_what_could_not_be_written_at_the_end_is_said(failing: Path, tmp_path: Path) -> None:
    from test_live_sources import wait_for

    config = tmp_path / "live.toml"
    text = CONFIG.format(machine=", ".join(f"{k} = {v!r}" for k, v in MACHINE.items()))
    config.write_text(text + '[[sink]]\nkind = "parquet"\nfolder = "live.toml"\n')
    lines = failing.read_text().splitlines(keepends=True)
    (tmp_path / "log.csv").write_text("".join(lines))
    # A folder stands where the log around the event belongs.
    (tmp_path / "state" / "events" / "m-1.csv" / "x").mkdir(parents=True)
    run = start(config)
    wait_for(lambda: saved(tmp_path).get("counts", {}).get("rows") == len(lines) - 1, 120)  # type: ignore[attr-defined]
    run.send_signal(signal.SIGINT)
    out, err = run.communicate(timeout=300)
    assert run.returncode == 0, err
    assert "the minutes around m-1 could not be kept" in out
    assert f"{len(lines) - 1} rows lost" in out


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no motor"),
        ("[motor.m]\n", "no machine"),
        ("[motor.m]\nmachine = {}\n", "no period_s"),
        ("[motor.m]\nmachine = { period_s = 1 }\n", "lacks"),
        ("x = 1\n", "unknown x"),
        ("[live\n", "not TOML"),
        ("[motor.m]\nmachine = 'none.toml'\n", "none.toml"),
        ("[[motor]]\nname = 'a'\n", "expected [motor.NAME]"),
        ("motor = 3\n", "expected a table"),
        ("[motor]\na = 3\n", "motor.a: expected a table"),
        ("live = 3\n", "live: expected a table"),
        ("[motor.m]\nmachine = {}\nsettings = 5\n", "settings: expected a table"),
        ("[motor.m]\nmachine = {}\nstall_s = 'x'\n", "stall_s is 'x'; expected a number above 0"),
        ("[motor.m]\nmachine = {}\nstall_s = -3\n", "stall_s is -3"),
        ("[motor.m]\nmachine = {}\narithmetic = 'q16'\n", "arithmetic is 'q16'; expected 'float' or 'q15'"),
        ("[motor.m]\nmachine = {}\nreplayed = 'no'\n", "replayed is 'no'; expected false or true"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(text: str, why: str, tmp_path: Path) -> None:
    config = tmp_path / "live.toml"
    config.write_text(text)
    done = start(config)
    _, err = done.communicate(timeout=300)
    assert done.returncode == 3 and why in err and err.count("\n") == 1, err
    assert str(config) in err
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ("[[sink]]\nkind = 'parquet'\nfolder = 'log'\nkeep_MB = -1\n", "keep_MB is -1; expected a number above 0"),
        ("[[sink]]\nkind = 'parquet'\n", "folder is ''; expected text"),
        ("[[source]]\nkind = 'serial'\nmotor = 'm'\nport = 'p'\nbaud = 'fast'\n", "baud is 'fast'"),
        ("[[source]]\nkind = 'udp'\nmotor = 'm'\nlisten = 5\n", "listen: 5; expected text"),
    ],
)
def test_values_that_cannot_be_are_named(table: str, why: str, tmp_path: Path) -> None:
    machine = ", ".join(f"{k} = {v!r}" for k, v in MACHINE.items())
    config = tmp_path / "live.toml"
    source = "" if "[[source]]" in table else "[[source]]\nkind = 'file'\nmotor = 'm'\npath = 'a.csv'\nformat = 'csv'\n"
    config.write_text(f"[motor.m]\nmachine = {{ {machine} }}\n{source}{table}")
    done = start(config)
    _, err = done.communicate(timeout=300)
    assert done.returncode == 3 and why in err and err.count("\n") == 1, err


def test_two_do_not_keep_one_state(failing: Path, tmp_path: Path) -> None:
    from test_live_sources import wait_for

    config = tmp_path / "live.toml"
    config.write_text(CONFIG.format(machine=", ".join(f"{k} = {v!r}" for k, v in MACHINE.items())))
    (tmp_path / "log.csv").write_text("".join(failing.read_text().splitlines(keepends=True)[:2000]))
    first = start(config)
    wait_for(lambda: (tmp_path / "state" / "m.state").exists(), 120)
    second = start(config)
    _, err = second.communicate(timeout=300)
    assert second.returncode == 3 and "another dqwatch live keeps its states there" in err
    first.send_signal(signal.SIGTERM)
    _, err = first.communicate(timeout=300)
    assert first.returncode == 0, err
