"""Each job gives the command's JSON to the last byte, and what it says of a simulated machine is true."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path

import pytest

import dqwatch

Command = Callable[..., str]


def test_fit_is_the_commands(servo_csv: Path, command: Command) -> None:
    assert dqwatch.fit(servo_csv).to_json() == command("fit", str(servo_csv), "--json")


def test_fit_text_is_the_commands(servo_csv: Path, command: Command) -> None:
    assert str(dqwatch.fit(servo_csv)) == command("fit", str(servo_csv))


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
def test_learn_is_the_commands(servo_csv: Path, command: Command, arithmetic: str) -> None:
    learned = dqwatch.learn(servo_csv, arithmetic=arithmetic)  # type: ignore[arg-type]
    assert learned.to_json() == command("learn", str(servo_csv), "--arith", arithmetic, "--json")
    assert ("dqw_estimator_q15" in learned.q15_config) == (arithmetic == "q15")


def test_fit_with_an_effect_is_the_commands(servo_csv: Path, command: Command) -> None:
    mine = dqwatch.fit(servo_csv, effects=["dead_time"], parameters=["R_ohm", "psi_Wb"])
    asked = ("--effect", "dead_time", "--parameters", "R_ohm,psi_Wb", "--json")
    assert mine.to_json() == command("fit", str(servo_csv), *asked)


def test_compare_is_the_commands(servo_csv: Path, command: Command, tmp_path: Path) -> None:
    mine = dqwatch.compare(servo_csv)
    assert mine.to_json() == command("compare", str(servo_csv), "--json", "--out", str(tmp_path))
    assert mine.to_html() == (tmp_path / "compare.html").read_text()


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
def test_monitor_is_the_commands(weak_csv: Path, command: Command, tmp_path: Path, arithmetic: str) -> None:
    mine = dqwatch.monitor(weak_csv, arithmetic=arithmetic)  # type: ignore[arg-type]
    asked = ("--arith", arithmetic, "--out", str(tmp_path))
    assert mine.to_json() == command("monitor", str(weak_csv), "--json", *asked)
    assert str(mine) == command("monitor", str(weak_csv), *asked)
    assert mine.to_html() == (tmp_path / "monitor.html").read_text()


def test_columns_is_the_commands(servo_csv: Path, command: Command) -> None:
    mine = dqwatch.columns(servo_csv)
    assert mine.to_json() == command("columns", str(servo_csv), "--json")
    assert str(mine) == command("columns", str(servo_csv))


def test_columns_of_what_cannot_be_fitted_yet(servo: dqwatch.SimResult) -> None:
    some = {"time": servo["t_s"], "rpm": servo["w_m_rad_s"] * 30 / 3.141592653589793, "i_q_A": servo["i_q_A"]}
    rpm = {"from": "rpm", "unit": "rpm"}
    found = dqwatch.columns(some, machine={"columns": {"t_s": "time", "w_m_rad_s": rpm}})
    assert found.regime is None and found.rows == found.rows_kept == len(servo)
    assert any("torque_Nm" in what for what in found.missing)
    speed = found.columns["w_m_rad_s"]
    assert speed.kept and speed.made_of == ("rpm",) and speed.unit == "rpm"
    assert speed.largest == pytest.approx(servo["w_m_rad_s"].max())
    with pytest.raises(dqwatch.UsageError):
        dqwatch.columns([some, some])
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.rows = 1  # type: ignore[misc]


def test_trace_is_the_commands(servo_csv: Path, command: Command, tmp_path: Path) -> None:
    mine = dqwatch.trace(servo_csv, effects=["dead_time"])
    asked = ("--effect", "dead_time", "--out", str(tmp_path))
    assert mine.to_json() == command("trace", str(servo_csv), "--json", *asked)
    assert mine.to_html() == (tmp_path / "report.html").read_text()


def test_simulation_is_the_commands(command: Command, tmp_path: Path) -> None:
    command("sim", "servo", "--set", "duration_s=0.05", "--seed", "7", "--out", str(tmp_path))
    mine = dqwatch.simulate(scenario="servo", duration_s=0.05, seed=7)
    lines = (tmp_path / "servo.csv").read_text().splitlines()
    assert lines[0].split(",") == list(mine.columns)
    for k, line in enumerate(lines[1:]):
        for name, text in zip(mine.columns, line.split(","), strict=True):
            digits = 12 if name == "t_s" else 9
            assert f"{mine[name][k]:.{digits}g}" == text


def test_fit_finds_the_truth(servo: dqwatch.SimResult) -> None:
    found = dqwatch.fit(servo, pole_pairs=4)
    assert found.verdict == "usable" and found.rows_used == len(servo)
    for name in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb"):
        p = found.parameters[name]
        assert p.sd is not None and 0 < p.sd
        assert abs(p.value - servo.truth[name]) < 5 * p.sd
        assert p.usable and not p.why
    assert found.parameters["psi_Wb"].unit == "Wb" and found.parameters["pole_pairs"].given


def test_what_a_log_cannot_tell(servo: dqwatch.SimResult) -> None:
    found = dqwatch.fit(servo, pole_pairs=4, parameters=["R_ohm", "J_kgm2"])
    assert found.verdict == "partly_usable" and "J_kgm2" not in found.parameters
    (lost,) = found.not_identifiable
    assert lost.name == "J_kgm2" and lost.why and lost.excitation
    assert dqwatch.fit(servo, pole_pairs=4, parameters=["J_kgm2"]).verdict == "not_usable"


def test_trace_names_dead_time() -> None:
    log = dqwatch.simulate(scenario="effect_dead_time", duration_s=0.6)
    found = dqwatch.trace(log, pole_pairs=4, effects=["dead_time"])
    assert [e.name for e in found.effects] == ["dead_time"]
    loss = found.effects[0].parameters["voltage_V"]
    assert loss.sd is not None and abs(loss.value - 4.0) < 5 * loss.sd + 0.2
    assert found.residual_after < 0.5 * found.residual_before
    # What it found is what the learners take.
    again = dqwatch.learn(log, pole_pairs=4, config=found)
    assert [e.name for e in again.effects] == ["dead_time"]


def test_monitor_names_demagnetisation(weak: dqwatch.SimResult) -> None:
    found = dqwatch.monitor(weak, machine={"pole_pairs": 4, "J_kgm2": 2e-3})
    assert [e.fault for e in found.events] == ["demagnetisation"]
    event = found.events[0]
    assert event.parameter == "psi_Wb" and 1.0 < event.since_s < event.t_s
    assert event.value < event.healthy


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no /proc")
def test_a_path_may_be_bytes_or_a_path(servo_csv: Path) -> None:
    one = dqwatch.fit(str(servo_csv)).to_json()
    assert one == dqwatch.fit(servo_csv).to_json()


def test_two_logs_of_one_machine(servo_csv: Path, tmp_path: Path, command: Command) -> None:
    lines = servo_csv.read_text().splitlines(keepends=True)
    half = tmp_path / "half.csv"
    half.write_text(lines[0] + "".join(lines[2501:]))
    half.with_suffix(".toml").write_bytes(servo_csv.with_suffix(".toml").read_bytes())
    first = tmp_path / "first.csv"
    first.write_text("".join(lines[:2501]))
    first.with_suffix(".toml").write_bytes(servo_csv.with_suffix(".toml").read_bytes())
    both = dqwatch.fit([first, str(half)])
    assert both.rows_used == 5000
    assert both.to_json() == command("fit", str(first), str(half), "--json")
