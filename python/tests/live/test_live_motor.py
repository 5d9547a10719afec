from __future__ import annotations

import dataclasses
import errno
from pathlib import Path

import numpy as np
import pytest
from joints import MACHINE, PERIOD_S, rows_of

import dqwatch
from dqwatch.live import motor as motor_module
from dqwatch.live import state
from dqwatch.live.core import Live
from dqwatch.live.decode import Row
from dqwatch.live.motor import MOST_WAITING, LiveEvent, Motor, Settings
from dqwatch.live.sources import Source


class Rows:
    """A source of rows that a test holds."""

    def __init__(self, rows: list[Row], name: str = "m", at: int = 0) -> None:
        self.rows, self.name, self.at, self.due = rows, name, at, 0

    def poll(self) -> list[tuple[str, Row]]:
        new = self.rows[self.at : self.due]
        self.at = max(self.at, self.due)
        return [(self.name, r) for r in new]

    def where(self) -> dict[str, int]:
        return {"at": self.at}

    def close(self) -> None:
        pass


class Told:
    """A sink that remembers."""

    name = "told"

    def __init__(self) -> None:
        self.events: list[LiveEvent] = []
        self.tiles: list[dict[str, object]] = []
        self.row_numbers: list[tuple[int, int]] = []

    def event(self, event: LiveEvent) -> None:
        self.events.append(event)

    def tile(self, slug: str, tile: dict[str, object]) -> None:
        self.tiles.append(tile)

    def rows(self, motor: Motor, block: dict[str, np.ndarray], first: int) -> None:
        self.row_numbers.append((first, len(block["t_s"])))

    def keep(self, slug: str) -> None:
        """Nothing of it outlives the program."""

    def step(self, now_s: float) -> None:
        pass

    def trouble(self) -> str:
        return ""

    def close(self) -> None:
        pass


def live_of(rows: list[Row], folder: Path | None, told: Told) -> tuple[Live, Rows]:
    port = Rows(rows)

    def open_at(position: dict[str, int]) -> Rows:
        port.at = int(position.get("at", 0))
        return port

    source = Source("s", "test", open_at, [], motor="m")
    motor = Motor(Settings("m", MACHINE, folder=folder))
    return Live([motor], [source], [told], folder), port


def run(live: Live, port: Rows, until: int, by: int, now_s: float = 0.0) -> float:
    """By a clock of our own: 0.05 s a turn."""
    while port.due < until:
        port.due = min(port.due + by, until)
        now_s += 0.05
        live.step(now_s)
    return now_s


def test_events_are_those_of_the_monitor_alone(failing: Path) -> None:
    rows = rows_of(failing)
    alone = dqwatch.Monitor(MACHINE)
    expected = alone.block(**{c: np.array([r[c] for r in rows]) for c in rows[0]})
    assert [e.fault for e in expected] == ["demagnetisation"]
    for by in (37, 1000):
        told = Told()
        live, port = live_of(rows, None, told)
        run(live, port, len(rows), by)
        (event,) = told.events
        assert (event.t_s, event.value, event.confidence) == (
            expected[0].t_s,
            expected[0].value,
            expected[0].confidence,
        )
        assert 8.0 < event.t_s < 12.0 and "torque" in event.advice.lower()
        assert live.board.whole()["tiles"][0]["look"] == "fault"
        assert sum(n for _, n in told.row_numbers) == len(rows)
        assert [first for first, _ in told.row_numbers] == list(np.cumsum([0] + [n for _, n in told.row_numbers[:-1]]))


@pytest.mark.parametrize("killed_at", [3000, 17_990, 20_530, 20_600, 30_000])
def test_killed_at_any_moment_nothing_is_lost_or_counted_twice(failing: Path, tmp_path: Path, killed_at: int) -> None:
    rows = rows_of(failing)
    once = Told()
    live, port = live_of(rows, None, once)
    run(live, port, len(rows), 100)
    whole = live.motors["m"].monitor.status()

    first, second = Told(), Told()
    live, port = live_of(rows, tmp_path, first)
    now_s = run(live, port, killed_at, 100)
    # Killed: nothing is closed, nothing saved.
    live, port = live_of(rows, tmp_path, second)
    assert live.load() == 1
    port.due = live.motors["m"].position["at"]
    assert port.due <= killed_at
    run(live, port, len(rows), 100, now_s)
    told = {e.id: e for e in first.events + second.events}
    assert [(e.t_s, e.value) for e in told.values()] == [(e.t_s, e.value) for e in once.events]
    assert len(first.events) + len(second.events) == 1
    assert live.motors["m"].counts.rows == len(rows)
    assert live.motors["m"].event_count == 1
    assert live.motors["m"].monitor.status() == whole


def test_killed_between_disk_and_sinks_an_event_is_told_again_by_its_id(failing: Path, tmp_path: Path) -> None:
    class Dies(Told):
        def event(self, event: LiveEvent) -> None:
            raise KeyboardInterrupt

    rows = rows_of(failing)
    live, port = live_of(rows, tmp_path, Dies())
    with pytest.raises(KeyboardInterrupt):
        run(live, port, len(rows), 100)
    at = port.due
    told = Told()
    live, port = live_of(rows, tmp_path, told)
    live.load()
    assert port.at == 0 and live.motors["m"].position["at"] == at
    port.due = at
    live.step(1e3)
    assert [e.id for e in told.events] == ["m-1"] and live.motors["m"].event_count == 1
    again, _ = live_of(rows, tmp_path, told)
    again.load()
    again.step(2e3)
    assert len(told.events) == 1


def test_the_minutes_around_an_event_are_a_log(failing: Path, tmp_path: Path) -> None:
    rows = rows_of(failing)
    told = Told()
    live, port = live_of(rows, tmp_path, told)
    now_s = run(live, port, len(rows), 200)
    (event,) = told.events
    assert event.capture == ""
    live.close(now_s)
    assert live.board.whole()["events"][0]["capture"] == f"{event.id}.csv"
    log = rows_of(tmp_path / f"{event.id}.csv")
    assert log[0]["t_s"] == pytest.approx(rows[0]["t_s"]) and len(log) == len(rows)
    assert log[777] == pytest.approx(rows[777], rel=1e-8)
    fitted = dqwatch.fit(str(tmp_path / f"{event.id}.csv"))
    assert fitted.parameters["R_ohm"].value == pytest.approx(0.5, rel=0.2)


def test_the_clock_of_a_motor_may_be_set(healthy: Path) -> None:
    rows = rows_of(healthy)[:4000]
    told = Told()
    motor = Motor(Settings("m", MACHINE))
    live, port = live_of(rows + rows[1000:], None, told)
    run(live, port, len(port.rows), 100)
    motor = live.motors["m"]
    assert motor.counts.clock_set == 1 and motor.counts.late == 0
    assert motor.counts.rows == 7000
    assert motor.t_s == pytest.approx(7001 * PERIOD_S, rel=1e-3)
    # Rows that are sent again are late, not new; a second of them at most.
    live, port = live_of(rows + rows[-500:], None, told)
    run(live, port, len(port.rows), 100)
    assert live.motors["m"].counts.late == 500
    assert live.motors["m"].counts.rows == 4000
    # Where stamps never begin anew nothing is ever counted twice.
    live, port = live_of(rows + rows, None, told)
    live.motors["m"].settings.replayed = True
    run(live, port, len(port.rows), 100)
    assert live.motors["m"].counts.late == 4000 and live.motors["m"].counts.rows == 4000


def test_a_source_that_stalls_is_said_and_rows_go_on(healthy: Path) -> None:
    rows = rows_of(healthy)
    told = Told()
    live, port = live_of(rows, None, told)
    now_s = run(live, port, 12_000, 100)
    assert live.board.whole()["tiles"][0]["look"] == "healthy"
    live.step(now_s + 4.0)
    assert live.board.whole()["tiles"][0]["look"] == "healthy"
    live.step(now_s + 6.0)
    tile = live.board.whole()["tiles"][0]
    assert tile["look"] == "stalled" and tile["silent_s"] == 6
    run(live, port, 14_000, 100, now_s + 7.0)
    assert live.board.whole()["tiles"][0]["look"] == "healthy"


def test_more_rows_than_can_wait_are_counted() -> None:
    motor = Motor(Settings("m", MACHINE))
    row = {"v_d_V": 0.0, "v_q_V": 0.0, "i_d_A": 0.0, "i_q_A": 0.0, "w_m_rad_s": 0.0}
    for _ in range(MOST_WAITING + 5):
        motor.push(row, 0.0)
    motor.step(0.0)
    assert motor.counts.rows == MOST_WAITING and motor.counts.dropped == 5


def test_a_full_disk_is_said_and_survived(failing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = rows_of(failing)
    told = Told()
    live, port = live_of(rows, tmp_path, told)
    now_s = run(live, port, 10_000, 100)
    assert live.health()["trouble"] == []

    def full(path: Path, data: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(state, "replace_file", full)
        patch.setattr("dqwatch.live.capture.replace_file", full)
        now_s = run(live, port, len(rows), 100, now_s)
        assert live.health()["trouble"] == ["the state cannot be kept: No space left on device"]
        live.motors["m"].finish()
        assert live.motors["m"].counts.captures_left == 1
    assert len(told.events) == 1
    for _ in range(400):
        now_s += 0.05
        live.step(now_s)
    assert live.health()["trouble"] == []
    again, _ = live_of(rows, tmp_path, Told())
    again.load()
    assert again.motors["m"].counts.rows == len(rows)


def test_foreign_and_damaged_states_are_refused(healthy: Path, tmp_path: Path) -> None:
    live, port = live_of(rows_of(healthy), tmp_path, Told())
    now_s = run(live, port, 2000, 100)
    live.close(now_s)
    path = tmp_path / "m.state"
    good = path.read_bytes()
    for bad in (good[:-1], good[:500] + b"x" + good[501:], b"", b"hello\n", good.replace(b"state/1", b"state/2", 1)):
        path.write_bytes(bad)
        with pytest.raises(ValueError, match="remove it to begin anew"):
            live_of([], tmp_path, Told())[0].load()
    path.write_bytes(good)
    other = Motor(dataclasses.replace(live.motors["m"].settings, machine={**MACHINE, "pole_pairs": 7}))
    with pytest.raises(ValueError, match="another configuration"):
        other.load(tmp_path)
    assert not list(tmp_path.glob("*.new"))


def test_a_name_that_is_not_configured_is_counted() -> None:
    live, port = live_of([{"i_d_A": 1.0}], None, Told())
    port.name = "<img src=x>"
    port.due = 1
    live.step(0.0)
    assert live.health()["unknown_rows"] == 1 and live.health()["first_unknown"] == "<img src=x>"
    assert motor_module.MOST_EVENTS == 200


def test_memory_stays_flat_over_hours(healthy: Path, failing: Path) -> None:
    """Four motors at 100 Hz for an hour of theirs; `make bench` has the day."""
    from endless import endless

    found = endless(hours=1.0, motors=4)
    assert found["rows"] == 4 * 360_000
    assert found["events_told"] == found["events_expected"] > 0
    assert found["events_twice"] == 0


def test_the_demo_fails_after_a_minute_of_its_clock(tmp_path: Path) -> None:
    from dqwatch.live.demo import demo

    clock = [0.0]
    live, _ = demo(tmp_path, lambda: clock[0])
    told: list[tuple[float, LiveEvent]] = []
    known: set[str] = set()
    while clock[0] < 75.0:
        live.step(clock[0])
        new = [e for m in live.motors.values() for e in m.events if e.id not in known]
        told += [(clock[0], e) for e in new]
        known |= {e.id for e in new}
        clock[0] += 0.25
    assert [(e.motor, e.fault) for _, e in told] == [("right wheel", "demagnetisation")]
    # Named 2.1 s behind the minute, and told in the turn in which it was.
    assert 60.0 < told[0][1].t_s < 66.0 and told[0][0] - told[0][1].t_s < 0.3
