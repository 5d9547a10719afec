"""Monitor and Estimator: rows as they come are the rows of the log, and a pickled one goes on to the bit."""

from __future__ import annotations

import json
import math
import os
import pickle
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dqwatch

MACHINE = {"pole_pairs": 4, "J_kgm2": 2e-3}
PLATE = {"period_s": 1e-4, "v_V": 180.0, "i_A": 10.0, "w_m_rad_s": 150.0}
SIGNALS = ("v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad")


def part(log: dqwatch.SimResult, begin: int, end: int | None = None) -> dict[str, Any]:
    return {name: column[begin:end] for name, column in log.columns.items()}


def rows(log: dqwatch.SimResult, begin: int, end: int) -> list[dict[str, float]]:
    return [{name: float(log[name][k]) for name in (*SIGNALS, "t_s")} for k in range(begin, end)]


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
def test_a_stream_is_the_job(weak: dqwatch.SimResult, arithmetic: Any) -> None:
    whole = dqwatch.monitor(weak, machine=MACHINE, arithmetic=arithmetic)
    stream = dqwatch.Monitor.for_log(weak, machine=MACHINE, arithmetic=arithmetic)
    events = [e for begin in range(0, len(weak), 7001) for e in stream.block(part(weak, begin, begin + 7001))]
    assert events and events == list(whole.events)
    assert stream.rows == len(weak) and stream.t_s == weak["t_s"][-1]


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
@pytest.mark.parametrize("at", [0, 1, 4999, 25000])
def test_pickled_in_mid_stream(weak: dqwatch.SimResult, arithmetic: Any, at: int) -> None:
    one = dqwatch.Monitor(MACHINE, **PLATE, arithmetic=arithmetic)
    straight = one.block(part(weak, 0))
    other = dqwatch.Monitor(MACHINE, **PLATE, arithmetic=arithmetic)
    first = other.block(part(weak, 0, at)) if at else []
    again = pickle.loads(pickle.dumps(other))
    del other
    assert first + again.block(part(weak, at)) == straight
    assert again.status() == one.status()
    assert again.arithmetic == arithmetic and again.settings() == one.settings()


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
def test_an_estimator_is_pickled(servo: dqwatch.SimResult, arithmetic: Any) -> None:
    one = dqwatch.Estimator(MACHINE, **PLATE, arithmetic=arithmetic)
    one.block(part(servo, 0))
    other = dqwatch.Estimator(MACHINE, **PLATE, arithmetic=arithmetic)
    other.block(part(servo, 0, 1777))
    again = dqwatch.Estimator.from_state(other.state())
    again.block(part(servo, 1777))
    assert again.status() == one.status()


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
def test_an_estimator_finds_the_truth(weak: dqwatch.SimResult, arithmetic: Any) -> None:
    estimator = dqwatch.Estimator(MACHINE, **PLATE, arithmetic=arithmetic)
    estimator.block(part(weak, 0, 10000))
    for name in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb"):
        p = estimator.parameters[name]
        assert p.sd is not None and abs(p.value - weak.truth[name]) < 5 * p.sd + 0.01 * weak.truth[name], name
    assert estimator.status()["pole_pairs"] == 4


def test_rows_one_by_one(servo: dqwatch.SimResult) -> None:
    by_block, by_row = (dqwatch.Monitor(MACHINE, **PLATE) for _ in range(2))
    told = by_block.block(part(servo, 0, 3000))
    assert [e for row in rows(servo, 0, 3000) for e in by_row.step(**row)] == told
    assert by_row.status() == by_block.status()
    # A period of the configuration stands for a clock.
    blind = dqwatch.Monitor(MACHINE, **PLATE)
    for row in rows(servo, 0, 3000):
        del row["t_s"]
        blind.step(**row)
    assert blind.status()["parameters"] == by_row.status()["parameters"]


def test_bands(weak: dqwatch.SimResult) -> None:
    found = {}
    for arithmetic in ("float", "q15"):
        stream = dqwatch.Monitor(MACHINE, **PLATE, arithmetic=arithmetic)  # type: ignore[arg-type]
        stream.block(part(weak, 0, 13000))  # healthy values stand, and nothing is being named yet
        status = stream.status()
        assert status["in_service"] and status["stage"] == "in service"
        psi = status["parameters"]["psi_Wb"]
        assert psi["watched"] and psi["why"] == ""
        # (E63): its band is 1.2 % of its healthy value, and no less is told.
        assert psi["band"] == pytest.approx(0.012 * psi["healthy"], rel=0.02)
        assert psi["least_change"] >= 0.999 * psi["band"]
        found[arithmetic] = status["parameters"]
    for name in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb", "dead_time_V", "friction_Nm"):
        a, b = found["float"][name]["band"], found["q15"][name]["band"]
        assert a is not None and b == pytest.approx(a, rel=0.05), (name, a, b)


def test_what_is_not_watched_says_why() -> None:
    stream = dqwatch.Monitor({"pole_pairs": 4}, **PLATE)
    status = stream.status()
    assert not status["in_service"] and status["rows"] == 0
    assert all(not c["watched"] and c["why"] for c in status["parameters"].values())


@pytest.mark.parametrize("arithmetic", ["float", "q15"])
def test_what_is_not_finite_is_counted(servo: dqwatch.SimResult, arithmetic: Any) -> None:
    stream = dqwatch.Monitor(MACHINE, **PLATE, arithmetic=arithmetic)
    for k, row in enumerate(rows(servo, 0, 100)):
        if k % 10 == 3:
            row[("i_d_A", "v_q_V", "w_m_rad_s", "theta_e_rad")[k % 4]] = math.nan if k % 20 == 3 else math.inf
        stream.step(**row)
    assert stream.status()["refused"] == {"not_finite": 10, "saturated": 0, "stuck": 0, "incomplete_blocks": 0}


def test_time(servo: dqwatch.SimResult) -> None:
    stream = dqwatch.Monitor(MACHINE, **PLATE)
    row = rows(servo, 0, 1)[0]
    stream.step(**{**row, "t_s": 5.0})
    for late in (5.0, 4.0, math.inf):
        with pytest.raises(dqwatch.UsageError, match="time to increase"):
            stream.step(**{**row, "t_s": late})
    stream.step(**{**row, "t_s": 5.01})
    assert stream.rows == 2 and stream.t_s == 5.01
    with pytest.raises(dqwatch.UsageError, match="row 2 of the block"):
        stream.block({**part(servo, 0, 3), "t_s": [6.0, 6.1, 6.1]})


def test_blocks_that_are_none(servo: dqwatch.SimResult) -> None:
    stream = dqwatch.Monitor(MACHINE, **PLATE)
    good = part(servo, 0, 50)
    for bad, word in (
        ({n: c for n, c in good.items() if n != "i_q_A"}, "i_q_A"),
        ({**good, "i_q_A": good["i_q_A"][:-1]}, "rows"),
        ({**good, "i_q_A": ["x"] * 50}, "i_q_A"),
        (3, "int"),
        (None, "arrays by name"),
    ):
        with pytest.raises(dqwatch.UsageError, match=word):
            stream.block(bad)
    with pytest.raises(dqwatch.UsageError):
        stream.step(i_d_A="1", i_q_A=0, v_d_V=0, v_q_V=0, w_m_rad_s=0)  # type: ignore[arg-type]
    assert stream.rows == 0


def test_machines_that_are_none() -> None:
    for machine, given in (
        ({}, {}),
        ({"pole_pairs": 4}, {}),
        ({"pole_pairs": 0}, PLATE),
        ({"pole_pairs": 4.5}, PLATE),
        ({"pole_pairs": 4, "no_such": 1}, PLATE),
        ({"pole_pairs": 4, "R_ohm": math.nan}, PLATE),
        ({"pole_pairs": 4, "band": {"no_such": 1}}, PLATE),
        ({"pole_pairs": 4, "modulation": "no_such"}, PLATE),
        ({"pole_pairs": 4, "angle": 1}, PLATE),
        ({"pole_pairs": 4, "R_ohm": object()}, PLATE),
        ("/nowhere.toml", PLATE),
        ({"pole_pairs": 4}, {**PLATE, "period_s": 0.0}),
        ({"pole_pairs": 4}, {**PLATE, "arithmetic": "double"}),
    ):
        with pytest.raises(dqwatch.Error):
            dqwatch.Monitor(machine, **given)


def test_machine_files(tmp_path: Path, servo_csv: Path) -> None:
    toml = tmp_path / "machine.toml"
    toml.write_text(
        "[machine]\npole_pairs = 4\nR_ohm = 0.9\n[nameplate]\nv_V = 180\ni_A = 10\nw_m_rad_s = 150\nperiod_s = 1e-4\n"
    )
    found = dqwatch.Monitor(toml).settings()
    assert found["pole_pairs"] == 4 and found["v_base_V"] == 180 and found["R_ohm"] == pytest.approx(0.9)
    fitted = tmp_path / "fit.json"
    fitted.write_text(dqwatch.fit(servo_csv).to_json())
    found = dqwatch.Monitor(fitted, **PLATE).settings()
    assert found["psi_Wb"] == pytest.approx(0.12, rel=0.01) and found["pole_pairs"] == 4
    again = dqwatch.Monitor(found)
    assert again.settings() == found


def test_foreign_states() -> None:
    monitor, estimator = dqwatch.Monitor(MACHINE, **PLATE), dqwatch.Estimator(MACHINE, **PLATE)
    state = monitor.state()
    assert dqwatch.Monitor.from_state(state).state() == state
    damaged = bytearray(state)
    damaged[len(state) // 2] ^= 1
    for bad, word in (
        (b"", "no state"),
        (b"dqwatch state", "no state"),
        (state[:-1], "check sum"),
        (state + b"\0", "check sum"),
        (bytes(damaged), "check sum"),
        (state.replace(b"state 1 ", b"state 2 ", 1), "version"),
        (estimator.state(), "estimator"),
    ):
        with pytest.raises(dqwatch.InputError, match=word):
            dqwatch.Monitor.from_state(bad)
    with pytest.raises(dqwatch.UsageError):
        dqwatch.Monitor.from_state("text")  # type: ignore[arg-type]


def test_states_of_other_builds() -> None:
    import hashlib

    _, _, body = dqwatch.Monitor(MACHINE, **PLATE).state().partition(b"\n")
    head, _, image = body.partition(b"\n")

    def made(change: dict[str, Any], image: bytes) -> bytes:
        text = json.dumps({**json.loads(head), **change}).encode() + b"\n" + image
        return b"dqwatch state 1 " + hashlib.sha256(text).hexdigest().encode() + b"\n" + text

    dqwatch.Monitor.from_state(made({}, image))
    with pytest.raises(dqwatch.InputError, match="this build"):
        dqwatch.Monitor.from_state(made({"build": "dqwatch 9.9.9"}, image))
    for short in (image[:-1], image[:10], b"", image + b"x"):
        with pytest.raises(dqwatch.InputError, match="does not fit"):
            dqwatch.Monitor.from_state(made({}, short))


def test_two_threads_on_one(weak: dqwatch.SimResult) -> None:
    stream = dqwatch.Monitor(MACHINE, **PLATE)
    refused: list[str] = []
    begun = threading.Event()
    log = {name: np.tile(weak[name], 4) for name in SIGNALS}

    def work() -> None:
        begun.set()
        stream.block(log)

    thread = threading.Thread(target=work)
    thread.start()
    begun.wait()
    while thread.is_alive():
        try:
            stream.status()
        except dqwatch.UsageError as error:
            refused.append(str(error))
    thread.join()
    assert refused and all("another thread" in text for text in refused)
    assert stream.rows == 4 * len(weak)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_between_rows(servo: dqwatch.SimResult) -> None:
    stream = dqwatch.Monitor(MACHINE, **PLATE)
    stream.block(part(servo, 0, 2000))
    child = os.fork()
    stream.block(part(servo, 2000))
    if child == 0:
        os._exit(0 if stream.rows == len(servo) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
