"""Prometheus: numbers of every motor, as text, made of the board when somebody asks."""

from __future__ import annotations

from collections.abc import Iterable

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from ..board import Board


class _Motors:
    def __init__(self, board: Board) -> None:
        self._board = board

    def collect(self) -> Iterable[Metric]:
        up = GaugeMetricFamily("dqwatch_motor_look", "1 for what the motor's tile says", labels=["motor", "look"])
        rows = CounterMetricFamily("dqwatch_rows", "Rows learned", labels=["motor"])
        events = CounterMetricFamily("dqwatch_events", "Changes named", labels=["motor"])
        late = CounterMetricFamily("dqwatch_rows_left_out", "Rows left out", labels=["motor", "why"])
        value = GaugeMetricFamily("dqwatch_parameter", "Learned value, SI", labels=["motor", "parameter"])
        sd = GaugeMetricFamily("dqwatch_parameter_sd", "Its deviation, SI", labels=["motor", "parameter"])
        for tile in self._board.whole()["tiles"]:
            name = tile["name"]
            detail = self._board.detail(tile["slug"])
            if detail is None:
                continue
            up.add_metric([name, tile["look"]], 1)
            rows.add_metric([name], detail["rows"])
            events.add_metric([name], tile["events"])
            for why in ("late", "dropped"):
                late.add_metric([name, why], detail["counts"][why])
            for parameter, p in detail["parameters"].items():
                if p["value"] is not None:
                    value.add_metric([name, parameter], p["value"])
                if p["sd"] is not None:
                    sd.add_metric([name, parameter], p["sd"])
        yield from (up, rows, events, late, value, sd)
        broken = CounterMetricFamily("dqwatch_messages_broken", "Messages dropped", labels=["source"])
        connected = GaugeMetricFamily("dqwatch_source_connected", "1 where it is there", labels=["source"])
        for source in self._board.whole()["sources"]:
            broken.add_metric([source["name"]], source["broken"])
            connected.add_metric([source["name"]], float(source["connected"]))
        yield from (broken, connected)


def metrics(board: Board) -> bytes:
    """The text that Prometheus scrapes."""
    registry = CollectorRegistry()
    registry.register(_Motors(board))
    return generate_latest(registry)
