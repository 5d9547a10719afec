"""`dqwatch live CONFIG.toml`: reads the configuration, runs the loop by the clock until it is told to end."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any

from .core import Live
from .setup import ConfigError, live_of, read_config
from .state import hold

#: From turn to turn: what an event comes late by. What a turn costs beside its rows is paid so seldom.
TURN_S = 0.05


def _arguments(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="dqwatch live", description="Watch running motors. docs/live.md has the configuration."
    )
    parser.add_argument("config", nargs="?", help="CONFIG.toml: motors, sources, sinks")
    parser.add_argument("--demo", action="store_true", help="two simulated motors, one of which fails after a minute")
    parser.add_argument("--listen", metavar="HOST:PORT", help="of the page [127.0.0.1:8600]")
    parser.add_argument("--token", help="who may see it beyond this machine; also by DQWATCH_TOKEN")
    parser.add_argument("--no-page", action="store_true", help="without a page")
    return parser.parse_args(list(argv))


def run(argv: Sequence[str]) -> int:
    """The subcommand. Returns 0, 2 on wrong usage, 3 where the configuration cannot be."""
    try:
        asked = _arguments(argv)
    except SystemExit as end:
        return int(end.code or 0)
    if asked.demo == bool(asked.config):
        print("dqwatch live: expected CONFIG.toml, or --demo", file=sys.stderr)
        return 2
    try:
        if asked.demo:
            from .demo import demo

            with tempfile.TemporaryDirectory(prefix="dqwatch-live-") as folder:
                return _serve(*demo(Path(folder)), {}, asked)
        config = read_config(Path(asked.config))
        try:
            live, captures = live_of(config, Path(asked.config).resolve().parent)
        except (ConfigError, AttributeError, TypeError, ValueError, OSError) as error:
            raise ConfigError(f"{asked.config}: {error}") from None
        with hold(live.state) if live.state is not None else contextlib.nullcontext():
            known = live.load()
            if known:
                print(f"{known} of {len(live.motors)} motors go on where they were", flush=True)
            return _serve(live, captures, config.get("live", {}), asked)
    except (ConfigError, ValueError) as error:
        print(f"dqwatch live: {error}", file=sys.stderr)
        return 3
    except ModuleNotFoundError as error:
        print(f"dqwatch live: needs {error.name}; pip install './python[live]'", file=sys.stderr)
        return 1


def _serve(live: Live, captures: Path | None, table: dict[str, Any], asked: argparse.Namespace) -> int:
    logging.getLogger("can").setLevel(logging.ERROR)
    if not asked.no_page:
        from .setup import _address
        from .sinks.web import WebSink

        host, port = _address("listen", asked.listen or table.get("listen", "127.0.0.1:8600"), 8600)
        token = asked.token or os.environ.get("DQWATCH_TOKEN") or str(table.get("token", ""))
        try:
            web = WebSink(live.board, host, port, token, captures)
        except OSError as error:
            raise ConfigError(f"{host}:{port}: {error.strerror or error}; expected a free port (--listen)") from None
        live.sinks.append(web)
        shown = f"[{host}]" if ":" in host else host
        print(f"the page: http://{shown}:{web.port}/{'?token=…' if token else ''}", flush=True)
    ends: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        if ends:
            raise KeyboardInterrupt
        ends.append(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)
    while not ends:
        begun_s = time.monotonic()
        live.step(time.time())
        time.sleep(max(begun_s + TURN_S - time.monotonic(), 0.0))
    live.close(time.time())
    _summary(live)
    return 0


def _summary(live: Live) -> None:
    for motor in live.motors.values():
        print(f"{motor.name}: {motor.counts.rows} rows, {motor.event_count} events")
        for event in list(motor.events)[-10:]:
            print(f"  {event.t_s:.3f} s  {event.fault}, confidence {event.confidence:.2f}. {event.advice}")
        for note in motor.notes:
            print(f"  {note}")
    for trouble in live.health()["trouble"]:
        print(trouble)
