"""What goes wrong is an exception with its place and what to do; a job can be ended, and others run beside it."""

from __future__ import annotations

import os
import pickle
import signal
import threading
from pathlib import Path

import pytest

import dqwatch


def test_file_line_and_advice(servo_csv: Path, tmp_path: Path) -> None:
    lines = servo_csv.read_text().splitlines()
    lines[41] = lines[41].replace(lines[41].split(",")[3], "abc", 1)
    broken = tmp_path / "broken.csv"
    broken.write_text("\n".join(lines) + "\n")
    with pytest.raises(dqwatch.InputError) as caught:
        dqwatch.fit(broken)
    error = caught.value
    assert (error.file, error.line, error.row) == (str(broken), 42, None)
    assert str(error).startswith(f"{broken}:42: ") and error.advice == "expected a number"
    assert "\n" not in str(error)


def test_errors_are_pickled() -> None:
    with pytest.raises(dqwatch.InputError) as caught:
        dqwatch.fit("/nowhere/log.csv")
    again = pickle.loads(pickle.dumps(caught.value))
    assert type(again) is dqwatch.InputError and str(again) == str(caught.value)
    assert (again.file, again.line, again.advice) == ("/nowhere/log.csv", None, "expected a CSV log")


@pytest.mark.parametrize("name", ["/nowhere/log.csv", "/", "", "\0", "x" * 5000])
def test_paths_that_are_none(name: str) -> None:
    with pytest.raises((dqwatch.Error, ValueError)):
        dqwatch.fit(name)


def test_arguments_that_are_none(servo: dqwatch.SimResult) -> None:
    for wrong in (
        {"parameters": ["R"]},
        {"effects": ["no_such"]},
        {"format": "no_such"},
        {"config": "/nowhere/trace.json"},
        {"machine": "/nowhere.toml"},
        {"machine": {"pole_pairs": -1}},
        {"machine": {"R_ohm": object()}},
    ):
        with pytest.raises(dqwatch.Error):
            dqwatch.fit(servo, **{"pole_pairs": 4, **wrong})  # type: ignore[arg-type]
    with pytest.raises((dqwatch.Error, TypeError)):
        dqwatch.fit(servo, pole_pairs="four")  # type: ignore[arg-type]


def test_what_progress_raises_ends_the_job(servo: dqwatch.SimResult) -> None:
    told: list[tuple[str, float]] = []

    def stop(job: str, fraction: float) -> None:
        told.append((job, fraction))
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        dqwatch.trace(servo, pole_pairs=4, progress=stop)
    assert len(told) == 1 and 0.0 <= told[0][1] <= 1.0


def test_ctrl_c_ends_a_job(servo: dqwatch.SimResult) -> None:
    def interrupt(job: str, fraction: float) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    # Where the tests run in the background an interrupt is ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            dqwatch.trace(servo, pole_pairs=4, progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)
    assert dqwatch.fit(servo, pole_pairs=4).verdict == "usable"


def test_others_run_beside_it(servo: dqwatch.SimResult) -> None:
    ended: list[dqwatch.FitResult] = []
    thread = threading.Thread(target=lambda: ended.append(dqwatch.fit(servo, pole_pairs=4)))
    rounds = 0
    thread.start()
    while thread.is_alive():
        rounds += 1
    thread.join()
    assert ended and rounds > 1000


def test_four_at_once(servo: dqwatch.SimResult) -> None:
    one = dqwatch.fit(servo, pole_pairs=4).to_json()
    found: list[str] = []
    threads = [
        threading.Thread(target=lambda: found.append(dqwatch.fit(servo, pole_pairs=4).to_json())) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [one] * 4


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_in_the_middle(servo: dqwatch.SimResult) -> None:
    parent = os.getpid()
    children: list[int] = []

    def fork(job: str, fraction: float) -> None:
        if not children and os.getpid() == parent:
            child = os.fork()
            if child:
                children.append(child)

    try:
        dqwatch.trace(servo, pole_pairs=4, effects=["dead_time"], progress=fork)
    except dqwatch.UsageError as error:
        # The child: the work is the parent's.
        os._exit(0 if "forked" in str(error) else 1)
    except BaseException:
        if os.getpid() != parent:
            os._exit(2)
        raise
    if os.getpid() != parent:
        os._exit(3)
    if not children:
        pytest.skip("the job ended before it told anything")
    assert os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1]) == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_child_works_on(servo: dqwatch.SimResult) -> None:
    expected = dqwatch.fit(servo, pole_pairs=4).to_json()
    child = os.fork()
    if child == 0:
        try:
            os._exit(0 if dqwatch.fit(servo, pole_pairs=4).to_json() == expected else 1)
        except BaseException:
            os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
