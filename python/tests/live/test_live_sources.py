"""Each source against a real counterpart on this machine."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

for _needed in ("serial", "can", "cantools", "paho.mqtt.client"):
    pytest.importorskip(_needed, reason=f"needs {_needed}: ./python[live]")

from dqwatch.live.decode import COLUMNS, Decoder, Row, format_of  # noqa: E402
from dqwatch.live.sources import RETRY_S, Source  # noqa: E402

ROW = {"v_d_V": 1.5, "v_q_V": 2.0, "i_d_A": -0.25, "i_q_A": 3.0, "w_m_rad_s": 40.0}


def wait_for(what: Callable[[], object], at_most_s: float = 120.0) -> object:
    """What another process does takes its time; a bound, no measure."""
    end = time.monotonic() + at_most_s
    while time.monotonic() < end:
        found = what()
        if found:
            return found
        time.sleep(0.01)
    raise AssertionError("it never came")


def polled(source: Source, now_s: float) -> list[tuple[str, Row]]:
    """Each row alone, without what it does not say."""
    rows: list[tuple[str, Row]] = []
    for name, some in source.poll(now_s):
        alone = [some] if isinstance(some, dict) else [dict(zip(COLUMNS, r, strict=True)) for r in some.tolist()]
        rows.extend((name, {c: x for c, x in row.items() if x == x}) for row in alone)
    return rows


def gather(source: Source, count: int, now_s: float = 0.0) -> list[tuple[str, Row]]:
    rows: list[tuple[str, Row]] = []
    wait_for(lambda: rows.extend(polled(source, now_s)) or len(rows) >= count)
    return rows


def test_a_serial_port_that_goes_and_comes_back(tmp_path: Path) -> None:
    from dqwatch.live.sources.serial import opener

    link = tmp_path / "tty"
    ours, theirs = os.openpty()
    link.symlink_to(os.ttyname(theirs))
    decoder = Decoder(format_of("simplefoc", 7, {}), "m")
    source = Source("s", "serial", opener(str(link), 115200, decoder), [decoder], motor="m")
    assert source.poll(0.0) == [] and source.health.connected
    line = b"5.0000\t2.0000\t1.5000\t3000.0000\t-250.0000\t40.0000\t0.2500\n"
    os.write(ours, b"0.5000\t1.0\nBOOT " + bytes([0, 255]) + b"\n" + line[:20])
    assert source.poll(0.0) == []
    os.write(ours, line[20:] + line)
    assert [r for _, r in gather(source, 2)] == [pytest.approx({**ROW, "theta_e_rad": 1.75})] * 2
    assert source.health.broken == 2
    os.close(ours)
    os.close(theirs)
    wait_for(lambda: source.poll(1.0) or not source.health.connected)
    assert source.health.losses == 1 and source.health.trouble
    ours, theirs = os.openpty()
    link.unlink()
    link.symlink_to(os.ttyname(theirs))
    # Not before its time.
    assert source.poll(1.0 + RETRY_S / 2) == [] and not source.health.connected
    source.poll(1.1 + RETRY_S)
    assert source.health.connected
    os.write(ours, line)
    assert len(gather(source, 1, 3.0)) == 1
    source.close()


def test_udp_over_loopback() -> None:
    from dqwatch.live.sources.udp import opener

    decoder = Decoder(format_of("json", 4, {}), "")
    source = Source("s", "udp", opener("127.0.0.1", 0, decoder), [decoder])
    source.poll(0.0)
    port = source._port
    assert port is not None
    to = port.address  # type: ignore[attr-defined]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for k in range(200):
            out.sendto(json.dumps({"motor": f"m{k % 3}", "t_s": k, **ROW}).encode(), to)
        out.sendto(b"\x00" * 60_000, to)
        out.sendto(json.dumps({"motor": "m0", "t_s": 200, **ROW}).encode() + b"\n{broken", to)
    rows = gather(source, 201)
    for m in range(3):
        assert [r["t_s"] for n, r in rows if n == f"m{m}"] == [k for k in range(200) if k % 3 == m] + [200] * (m == 0)
    wait_for(lambda: source.poll(0.0) or source.health.broken == 2)
    assert source.health.dropped == 0
    source.close()


def test_udp_holds_so_much_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    from dqwatch.live.sources import udp

    monkeypatch.setattr(udp, "WAITING_BYTES", 10_000)
    port = udp.UdpPort("127.0.0.1", 0, Decoder(format_of("csv", 4, {}), "m"))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:

        def lost() -> int:
            # What has come is taken: where it comes slowly, another burst.
            dropped: int = port._datagrams.take()[1]
            for _ in range(20):
                out.sendto(b"#" * 999, port.address)
            return dropped

        wait_for(lost)
    port.close()


DBC = """VERSION ""
BU_: Drive
BO_ 256 Voltages: 8 Drive
 SG_ v_d : 0|16@1- (0.01,0) [0|0] "V" X
 SG_ v_q : 16|16@1- (0.01,0) [0|0] "V" X
BO_ 257 Currents: 8 Drive
 SG_ i_d : 0|16@1- (0.01,0) [0|0] "A" X
 SG_ i_q : 16|16@1- (0.01,0) [0|0] "A" X
 SG_ erpm : 32|32@1- (1,0) [0|0] "rpm" X
"""


def test_can_with_a_dbc(tmp_path: Path) -> None:
    import can

    from dqwatch.live.sources.can import opener

    dbc = tmp_path / "drive.dbc"
    dbc.write_text(DBC)
    rules = {
        "v_d_V": "v_d",
        "v_q_V": "v_q",
        "i_d_A": "i_d",
        "i_q_A": "i_q",
        "w_m_rad_s": {"from": "erpm", "scale": 0.1047197551 / 4},
    }
    decoder = Decoder(format_of("json", 4, rules), "m")
    bus = {"interface": "virtual", "channel": "dqwatch-test"}
    source = Source("s", "can", opener(bus, str(dbc), "Currents", decoder), [decoder], motor="m")
    source.poll(0.0)
    with can.Bus(**bus) as drive:

        def send(frame: int, *values: tuple[int, int]) -> None:
            data = b"".join(v.to_bytes(n, "little", signed=True) for v, n in values)
            drive.send(can.Message(arbitration_id=frame, data=data, is_extended_id=False))

        send(257, (-25, 2), (300, 2), (1528, 4))  # before any voltage: no row
        send(256, (150, 2), (200, 2), (0, 4))
        send(257, (-25, 2), (300, 2), (1528, 4))
        send(900, (1, 8))  # of another device
        drive.send(can.Message(arbitration_id=257, data=b"\x01", is_extended_id=False))  # cut off
        send(257, (-25, 2), (400, 2), (1528, 4))
        rows = gather(source, 2)
    assert rows[0] == ("m", pytest.approx({**ROW, "w_m_rad_s": 40.003}, rel=1e-3))
    assert rows[1][1]["i_q_A"] == pytest.approx(4.0)
    assert len(rows) == 2 and source.health.broken == 2
    source.close()


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Callable[[], tuple[subprocess.Popen[bytes], int]]]:
    """Starts mosquitto, always on one port."""
    program = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
    if program is None:
        pytest.skip("no mosquitto")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    config = tmp_path / "mosquitto.conf"
    config.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\npersistence false\nmax_queued_messages 0\n")
    running: list[subprocess.Popen[bytes]] = []

    def start() -> tuple[subprocess.Popen[bytes], int]:
        process = subprocess.Popen([program, "-c", str(config)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        running.append(process)

        def up() -> bool:
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", port)) == 0

        wait_for(up)
        return process, port

    yield start
    for process in running:
        process.kill()
        process.wait()


def test_mqtt_and_a_broker_that_goes(broker: Callable[[], tuple[subprocess.Popen[bytes], int]]) -> None:
    import paho.mqtt.client as mqtt

    from dqwatch.live.sources.mqtt import opener

    process, port = broker()
    decoder = Decoder(format_of("json", 4, {}), "")
    source = Source("s", "mqtt", opener("127.0.0.1", port, "motors/#", decoder), [decoder])
    source.poll(0.0)
    sender = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
    sender.connect("127.0.0.1", port)
    sender.loop_start()
    message = json.dumps({"motor": "m", **ROW})
    rows: list[tuple[str, Row]] = []

    def came() -> bool:
        sender.publish("motors/m", message)
        rows.extend(polled(source, 0.0))
        return len(rows) > 0

    wait_for(came)
    assert rows[0] == ("m", ROW)
    sender.publish("motors/m", b"\xff{").wait_for_publish(60)
    wait_for(lambda: source.poll(0.0) or source.health.broken == 1)
    process.kill()
    process.wait()
    wait_for(lambda: source.poll(1.0) or not source.health.connected)
    assert "broker" in source.health.trouble
    assert source.poll(2.5) == [] and not source.health.connected
    broker()
    source.poll(5.0)
    assert source.health.connected and source.health.connects == 2
    sender.reconnect()
    rows.clear()
    wait_for(came)
    sender.disconnect()
    sender.loop_stop()
    source.close()


def test_mqtt_sink_keeps_states_and_waits_for_its_broker(
    broker: Callable[[], tuple[subprocess.Popen[bytes], int]],
) -> None:
    import paho.mqtt.client as mqtt

    from dqwatch.live.motor import LiveEvent
    from dqwatch.live.sinks.mqtt import MOST_WAITING, MqttSink

    def event(k: int) -> LiveEvent:
        return LiveEvent(f"a_b-{k}", k, "a/b#", k, k, 0.0, "turn_short", "a", "short_S", 0.1, 0.01, 0.0, 0.9, "Stop.")

    process, port = broker()
    process.kill()
    process.wait()
    sink = MqttSink("127.0.0.1", port, "dq")
    for k in range(MOST_WAITING + 3):
        sink.event(event(k))
    sink.tile("a_b", {"look": "learning", "silent_s": 1})
    sink.tile("a_b", {"look": "fault", "silent_s": 2})
    sink.step(0.0)
    assert sink.trouble() == f"the MQTT broker 127.0.0.1:{port} is gone, 3 events dropped; {MOST_WAITING} events wait"
    broker()
    wait_for(lambda: sink._connected)
    got: list[tuple[str, bytes, bool]] = []
    reader = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
    reader.on_message = lambda _c, _d, m: got.append((m.topic, m.payload, bool(m.retain)))
    there: list[int] = []
    reader.on_subscribe = lambda *_: there.append(1)
    reader.connect("127.0.0.1", port)
    reader.subscribe("dq/#", 1)
    reader.loop_start()
    wait_for(lambda: there)
    wait_for(lambda: sink.step(1.0) or len(got) >= 1 + MOST_WAITING)
    events = [json.loads(p) for t, p, _ in got if t.endswith("/event")]
    assert [e["number"] for e in events] == list(range(3, MOST_WAITING + 3))
    assert all(t.count("/") == 2 and "#" not in t for t, _, _ in got)
    assert sink.trouble() == "3 events dropped"
    reader.disconnect()
    reader.loop_stop()
    # Who comes later has the state alone.
    late: list[tuple[str, bytes, bool]] = []
    reader = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
    reader.on_message = lambda _c, _d, m: late.append((m.topic, m.payload, bool(m.retain)))
    reader.connect("127.0.0.1", port)
    reader.subscribe("dq/#", 1)
    reader.loop_start()
    wait_for(lambda: late)
    assert late == [("dq/a_b/state", b'{"look": "fault"}', True)]
    reader.disconnect()
    reader.loop_stop()
    sink.close()


def test_a_growing_file_goes_on_where_it_was(tmp_path: Path) -> None:
    from dqwatch.live.sources.file import opener

    path = tmp_path / "log.csv"
    header = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n"

    def source(position: dict[str, object] | None = None) -> Source:
        decoder = Decoder(format_of("csv", 4, {}), "m")
        return Source("s", "file", opener(str(path), decoder), [decoder], position or {}, "m")

    first = source()
    assert first.poll(0.0) == [] and "No such file" in first.health.trouble
    path.write_text(header + "0,1,2,3,4,5\n1,1,2,3,4,5\n2,1,2")
    assert [r["t_s"] for _, r in first.poll(2.0)] == [0, 1]
    where = first.where()
    first.close()
    with path.open("a") as file:
        file.write(",3,4,5\n3,1,2,3,4,5\n")
    second = source(dict(where))
    assert [r["t_s"] for _, r in second.poll(0.0)] == [2, 3]
    # Cut, and written anew: from its beginning.
    path.write_text(header + "7,1,2,3,4,5\n")
    assert second.poll(1.0) == [] and "replaced or cut" in second.health.trouble
    assert [r["t_s"] for _, r in second.poll(3.0)] == [7]
    other = tmp_path / "other.csv"
    other.write_text(header + "8,1,2,3,4,5\n9,1,2,3,4,5\n")
    os.replace(other, path)
    second.poll(4.0)
    assert [r["t_s"] for _, r in second.poll(6.0)] == [8, 9]
    second.close()
