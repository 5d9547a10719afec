"""What the page's server gives, and to whom."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

for _needed in ("starlette", "uvicorn", "prometheus_client", "pyarrow"):
    pytest.importorskip(_needed, reason=f"needs {_needed}: ./python[live]")
pq = pytest.importorskip("pyarrow.parquet")

from joints import MACHINE, rows_of  # noqa: E402
from prometheus_client.parser import text_string_to_metric_families  # noqa: E402

import dqwatch  # noqa: E402
from dqwatch.live.board import Board  # noqa: E402
from dqwatch.live.core import Live, views  # noqa: E402
from dqwatch.live.motor import LiveEvent, Motor, Settings  # noqa: E402
from dqwatch.live.sinks.parquet import ParquetSink  # noqa: E402
from dqwatch.live.sinks.web import WebSink  # noqa: E402

HOSTILE = "<script>alert(1)</script>\"'&../.."


def event(k: int, motor: str = "m", capture: str = "") -> dict[str, object]:
    return asdict(
        LiveEvent(f"m-{k}", k, motor, k, k, 1e9, "turn_short", "a", "short_S", 0.1, 0.01, None, 0.9, "Stop.", capture)
    )


@pytest.fixture
def board() -> Board:
    made = Board()
    motor = Motor(Settings(HOSTILE, MACHINE))
    made.tile(motor.slug, *views(motor, 0.0))
    made.event(event(1, HOSTILE))
    return made


@pytest.fixture
def web(board: Board, tmp_path: Path) -> Iterator[WebSink]:
    sink = WebSink(board, "127.0.0.1", 0, "", tmp_path)
    yield sink
    sink.close()


def ask(port: int, path: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=300)
    connection.request(method, path, headers={k.replace("_", "-"): v for k, v in headers.items()})
    answer = connection.getresponse()
    found = (answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read())
    connection.close()
    return found


def stream(port: int, count: int, last: str = "") -> list[tuple[int, dict[str, object]]]:
    """The first messages."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=300)
    connection.request("GET", "/api/stream", headers={"Last-Event-ID": last} if last else {})
    answer = connection.getresponse()
    assert answer.headers["content-type"].startswith("text/event-stream")
    found: list[tuple[int, dict[str, object]]] = []
    number = 0
    while len(found) < count:
        line = answer.readline().decode()
        if line.startswith("id: "):
            number = int(line[4:])
        elif line.startswith("data: "):
            found.append((number, json.loads(line[6:])))
    connection.close()
    return found


def test_the_page_is_whole_and_names_stay_text(web: WebSink) -> None:
    for path, kind in (("/", "text/html"), ("/page.js", "text/javascript"), ("/page.css", "text/css")):
        status, headers, body = ask(web.port, path)
        assert status == 200 and headers["content-type"].startswith(kind)
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        text = body.decode()
        assert HOSTILE not in text and "http://" not in text.replace("http://www.w3.org/2000/svg", "")
        for sink in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "https://"):
            assert sink not in text
    everything = json.loads(ask(web.port, "/api/all")[2])
    assert everything["tiles"][0]["name"] == HOSTILE and set(everything["tiles"][0]["slug"]) & set("</>. ") == set()
    slug = everything["tiles"][0]["slug"]
    assert json.loads(ask(web.port, f"/api/motor/{slug}")[2])["name"] == HOSTILE
    for path in (
        "/api/motor/none",
        "/api/motor/..%2f..%2fetc%2fpasswd",
        "/../core.py",
        "/page/index.html",
        "/api/event/m-9/log",
    ):
        assert ask(web.port, path)[0] == 404


def test_the_stream_goes_on_behind_the_last_number(web: WebSink, board: Board) -> None:
    ((number, first),) = stream(web.port, 1)
    assert [e["id"] for e in first["events"]] == ["m-1"] and len(first["tiles"]) == 1  # type: ignore[index,arg-type,union-attr]
    board.event(event(2))
    board.event(event(3))
    ((_, more),) = stream(web.port, 1, str(number))
    assert [e["id"] for e in more["events"]] == ["m-2", "m-3"] and more["tiles"] == []  # type: ignore[union-attr]
    # A number of before a restart, or none: everything.
    for last in ("99999", "x", "-1", "9" * 400):
        ((_, whole),) = stream(web.port, 1, last)
        assert len(whole["events"]) == 3  # type: ignore[arg-type]


def test_who_may_ask(web: WebSink, board: Board) -> None:
    assert ask(web.port, "/", Host=f"localhost:{web.port}")[0] == 200
    assert ask(web.port, "/", Host="evil.example")[0] == 403
    assert ask(web.port, "/api/event/m-1/trace", "POST")[0] == 403
    assert ask(web.port, "/api/event/m-1/trace", "POST", X_Dqwatch="1")[0] == 404
    with pytest.raises(ValueError, match="expected --token"):
        WebSink(board, "0.0.0.0", 0, "", None)
    guarded = WebSink(board, "0.0.0.0", 0, "sesame", None)
    try:
        for path in ("/", "/api/all", "/api/stream", "/metrics", "/page.js", "/?token=wrong", "/?token=%ff"):
            assert ask(guarded.port, path)[0] == 401, path
        status, headers, _ = ask(guarded.port, "/?token=sesame")
        assert status == 303 and headers["location"] == "/"
        assert "HttpOnly" in headers["set-cookie"] and "samesite=strict" in headers["set-cookie"].lower()
        cookie = headers["set-cookie"].split(";")[0]
        assert ask(guarded.port, "/api/all", Cookie=cookie, Host="pump.example")[0] == 200
        assert ask(guarded.port, "/metrics", Authorization="Bearer sesame")[0] == 200
    finally:
        guarded.close()


def test_an_event_is_traced_by_a_button(healthy: Path, board: Board, tmp_path: Path) -> None:
    (tmp_path / "m-5.csv").write_text("".join(healthy.read_text().splitlines(keepends=True)[:8000]))
    (tmp_path / "m-5.toml").write_text('[log]\nregime = "dynamic"\n[machine]\npole_pairs = 4\n')
    board.event(event(5, capture="m-5.csv"))
    web = WebSink(board, "127.0.0.1", 0, "", tmp_path)
    try:
        assert json.loads(ask(web.port, "/api/event/m-5/trace", "POST", X_Dqwatch="1")[2])["state"] == "running"
        from test_live_sources import wait_for

        wait_for(lambda: json.loads(ask(web.port, "/api/event/m-5/trace")[2])["state"] != "running", 120)
        found = json.loads(ask(web.port, "/api/event/m-5/trace")[2])
        assert found["state"] == "done", found
        assert "dead_time" in json.dumps(found["trace"])  # type: ignore[index]
        assert ask(web.port, "/api/event/m-5/log")[2].startswith(b"t_s,")
    finally:
        web.close()


def test_metrics_are_prometheus_own(web: WebSink, board: Board) -> None:
    text = ask(web.port, "/metrics")[2].decode()
    families = {f.name: f for f in text_string_to_metric_families(text)}
    (look,) = families["dqwatch_motor_look"].samples
    assert look.labels == {"motor": HOSTILE, "look": "stalled"} and look.value == 1
    assert families["dqwatch_rows"].samples[0].value == 0


def test_a_parquet_log_is_the_rows(healthy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from test_live_motor import Rows, Told, run

    from dqwatch.live.sources import Source

    rows = rows_of(healthy)
    monkeypatch.setattr("dqwatch.live.sinks.parquet.SPAN_S", 2.0)
    port = Rows(rows)
    motor = Motor(Settings("m", MACHINE))
    sink = ParquetSink(tmp_path, 10**9)
    live = Live([motor], [Source("s", "t", lambda _: port, [], motor="m")], [sink, Told()], None)
    now_s = run(live, port, len(rows), 500)
    live.close(now_s)
    files = sorted((tmp_path / "motor=m").glob("*.parquet"))
    assert len(files) == 5 and files[0].name == "000000000000000.parquet"
    read = np.concatenate([pq.read_table(f)["v_q_V"].to_numpy() for f in files])
    assert np.array_equal(read, np.array([r["v_q_V"] for r in rows]))
    fitted = dqwatch.fit(pq.read_table(files[2]), pole_pairs=4)
    assert fitted.parameters["psi_Wb"].value == pytest.approx(0.02, rel=0.05)
    # A run without a state begins at row 0, and takes nothing of the log that is there but the file of its rows' name.
    anew = ParquetSink(tmp_path, 10**9)
    anew.rows(motor, {"t_s": np.array([0.0, 3.0]), "v_q_V": np.zeros(2)}, 0)
    assert sorted((tmp_path / "motor=m").glob("*.parquet")) == files
    # Goes on from a state that is older than its log: rows that come again are there once.
    start = int(files[3].stem) + 10
    times = np.concatenate([pq.read_table(f)["t_s"].to_numpy() for f in files[3:]])
    again = ParquetSink(tmp_path, 10**9)
    again.rows(motor, {"t_s": times[10:], "v_q_V": np.zeros(len(times) - 10)}, start)
    again.close()
    files = sorted((tmp_path / "motor=m").glob("*.parquet"))
    assert np.array_equal(np.concatenate([pq.read_table(f)["t_s"].to_numpy() for f in files[3:]]), times)
    # No disk: said, and the rows that were lost.
    blocked = ParquetSink(tmp_path / "motor=m" / files[0].name, 10**9)
    block = {"t_s": np.array([0.0, 3.0]), "v_d_V": np.zeros(2)}
    blocked.rows(motor, block, 0)
    assert "2 rows lost" in blocked.trouble()
    # Only so much of it.
    small = ParquetSink(tmp_path, files[0].stat().st_size * 2)
    small.rows(motor, block, 10**6)
    left = sorted((tmp_path / "motor=m").glob("*.parquet"))
    assert len(left) < 5 and left[-1].name == "000000001000000.parquet"
