"""The page in Chromium: it connects, loses and regains, shows an event, fits a telephone; names stay text."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

for _needed in ("starlette", "uvicorn", "prometheus_client"):
    pytest.importorskip(_needed, reason=f"needs {_needed}: ./python[live]")

from chrome import Chrome  # noqa: E402
from joints import MACHINE, rows_of  # noqa: E402
from test_live_motor import Rows  # noqa: E402

from dqwatch.live.core import Live  # noqa: E402
from dqwatch.live.motor import Motor, Settings  # noqa: E402
from dqwatch.live.sinks.web import WebSink  # noqa: E402
from dqwatch.live.sources import Lost, Source  # noqa: E402

HOSTILE = "<img src=x onerror=document.title='broken'>"


@pytest.fixture
def chrome(tmp_path: Path) -> Iterator[Chrome]:
    made = Chrome(tmp_path / "profile")
    yield made
    made.close()


class Flaky(Rows):
    """Rows of a source that can be taken away."""

    here = True

    def poll(self) -> list[tuple[str, dict[str, float]]]:
        if not self.here:
            raise Lost("pulled out")
        return super().poll()


def test_the_page(chrome: Chrome, failing: Path, tmp_path: Path) -> None:
    rows = rows_of(failing)
    flaky, other = Flaky(rows, "left"), Rows(rows[:100], HOSTILE)
    motors = [Motor(Settings("left", MACHINE, folder=tmp_path)), Motor(Settings(HOSTILE, MACHINE))]

    def reopen(_: object) -> Flaky:
        if not flaky.here:
            raise Lost("pulled out")
        return flaky

    sources = [Source("wheel", "test", reopen, []), Source("other", "test", lambda _: other, [])]
    live = Live(motors, sources, [], None)
    web = WebSink(live.board, "127.0.0.1", 0, "", tmp_path)
    now_s = 0.0

    def turn(until: int) -> None:
        nonlocal now_s
        while flaky.due < until:
            flaky.due += 200
            now_s += 0.1
            live.step(now_s)

    try:
        other.due = 100
        turn(1000)
        chrome.size(1280, 800)
        chrome.go(f"http://127.0.0.1:{web.port}/")
        chrome.until("document.querySelectorAll('.tile').length === 2")
        assert chrome.until("document.querySelector('#link').className === 'on'")
        tile = "document.querySelector('.tile[data-slug=left]')"
        assert chrome.until(f"{tile}.classList.contains('learning')")
        assert "learn" in chrome.run(f"{tile}.innerText")
        turn(14_000)
        chrome.until(f"{tile}.classList.contains('healthy')")
        assert chrome.run("document.querySelectorAll('#events li').length") == 0

        # The name is text, and nothing of it ran.
        assert HOSTILE in chrome.run("document.body.innerText")
        assert chrome.run("document.querySelectorAll('img').length") == 0

        flaky.here = False
        for _ in range(3):
            now_s += 4.0
            live.step(now_s)
        chrome.until(f"{tile}.classList.contains('stalled')")
        chrome.until("document.querySelector('#sources').innerText.includes('pulled out')")
        flaky.here = True
        now_s += 2.0
        turn(16_000)
        chrome.until(f"{tile}.classList.contains('healthy')")
        chrome.until("document.querySelector('#sources').innerText.includes('lost 1 time')")

        turn(len(rows))
        chrome.until("document.querySelectorAll('#events li').length === 1")
        text = chrome.run("document.querySelector('#events li').innerText")
        for part in ("demagnetisation", "left", "limit the current", "confidence ", "gathered"):
            assert part in text
        chrome.until(f"{tile}.classList.contains('fault')")
        motors[0].finish()
        live.step(now_s + 1.0)
        chrome.until("document.querySelector('#events li button') !== null")

        # A motor's own page.
        chrome.run(f"{tile}.click()")
        chrome.until("document.querySelectorAll('#plots figure').length >= 5")
        assert chrome.until("document.querySelector('#plots figure[data-parameter=psi_Wb] .mark') !== null")
        assert "18.8" in chrome.run("document.querySelector('#plots figure[data-parameter=psi_Wb] .now').innerText")
        assert "friction" in chrome.run("document.querySelector('#channels').innerText")
        # At a telephone's width nothing is wider than it.
        for page in ("#m/left", "#"):
            chrome.size(390, 844)
            chrome.run(f"location.hash = '{page}'")
            chrome.until("document.querySelector('#all').hidden === " + ("true" if len(page) > 1 else "false"))
            assert chrome.run("document.documentElement.scrollWidth") <= 390
        assert chrome.run("document.title") == "dqwatch live"
        assert chrome.console == []

        # The server is gone, and comes back on its port with all it knew.
        chrome.size(1280, 800)
        port = web.port
        web.close()
        chrome.until("document.querySelector('#link').className === ''")
        web = WebSink(live.board, "127.0.0.1", port, "", tmp_path)
        chrome.until("document.querySelector('#link').className === 'on'")
        assert chrome.run("document.querySelectorAll('#events li').length") == 1
    finally:
        web.close()
