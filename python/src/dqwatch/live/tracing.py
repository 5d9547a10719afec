"""Traces the minutes around an event, one after the other, each in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import deque
from pathlib import Path
from typing import Any

import dqwatch

MOST_WAITING = 20


class Tracer:
    """Logs in ``folder``; results stand beside them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._running: tuple[str, subprocess.Popen[bytes]] | None = None
        self._waiting: deque[tuple[str, str]] = deque()
        self._ended: set[str] = set()

    def start(self, event_id: str, log: str) -> str:
        """One more; "running", "waiting" or "full"."""
        self._look()
        if self._running is not None and self._running[0] == event_id:
            return "running"
        if any(e == event_id for e, _ in self._waiting):
            return "waiting"
        if len(self._waiting) >= MOST_WAITING:
            return "full"
        self._waiting.append((event_id, log))
        self._look()
        return "running" if self._running is not None and self._running[0] == event_id else "waiting"

    def _look(self) -> None:
        if self._running is not None and self._running[1].poll() is None:
            return
        if self._running is not None:
            self._ended.add(self._running[0])
        self._running = None
        if not self._waiting:
            return
        event_id, log = self._waiting.popleft()
        command = [sys.executable, "-m", "dqwatch.live.tracing", str(self.folder / log), str(self._out(event_id))]
        self._running = (
            event_id,
            subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL),
        )

    def _out(self, event_id: str) -> Path:
        return self.folder / f"{event_id}.trace.json"

    def result(self, event_id: str) -> dict[str, Any]:
        """``state``: none, waiting, running, failed or done; then with ``trace`` or ``error``."""
        self._look()
        if self._running is not None and self._running[0] == event_id:
            return {"state": "running"}
        if any(e == event_id for e, _ in self._waiting):
            return {"state": "waiting"}
        try:
            found: dict[str, Any] = json.loads(self._out(event_id).read_text())
        except (OSError, ValueError):
            if event_id in self._ended:
                return {"state": "failed", "error": "the trace ended without a result"}
            return {"state": "none"}
        return found

    def close(self) -> None:
        """A trace that runs ends."""
        if self._running is not None:
            self._running[1].kill()
            self._running[1].wait()


def run(log: str, out: str) -> int:
    """Trace one log and write what came of it."""
    try:
        traced = json.loads(dqwatch.trace(log).to_json())
        found = {"state": "done", "trace": traced}
    except dqwatch.Error as error:
        found = {"state": "failed", "error": str(error)}
    Path(out).write_text(json.dumps(found))
    return 0


if __name__ == "__main__":
    sys.exit(run(sys.argv[1], sys.argv[2]))
