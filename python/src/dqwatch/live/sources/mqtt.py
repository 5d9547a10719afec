"""MQTT: a message is a line or several, of JSON or CSV. The broker's thread fills a queue that has an end."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion

from ..decode import Decoder, Row, Rows
from . import Lost

MOST_WAITING = 20_000


class MqttPort:
    """Messages on ``topic``."""

    def __init__(self, host: str, port: int, topic: str, decoder: Decoder) -> None:
        self._decoder = decoder
        self._waiting: deque[bytes] = deque()
        self._lock = threading.Lock()
        self.dropped = 0
        self._lost = ""
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, client_id="")
        self._client.on_message = self._take
        self._client.on_disconnect = self._gone
        self._client.on_connect = lambda client, *_: client.subscribe(topic)
        try:
            self._client.connect(host, port, keepalive=10)
        except (OSError, ValueError) as error:
            raise Lost(f"broker {host}:{port}: {error}") from None
        self._client.loop_start()

    def _take(self, _client: Any, _data: Any, message: mqtt.MQTTMessage) -> None:
        with self._lock:
            if len(self._waiting) >= MOST_WAITING:
                self.dropped += 1
            else:
                self._waiting.append(bytes(message.payload))

    def _gone(self, _client: Any, _data: Any, _flags: Any, reason: Any, _more: Any) -> None:
        self._lost = f"the broker is gone: {reason}"

    def poll(self) -> Iterable[tuple[str, Row | Rows]]:
        """The rows of what has come."""
        with self._lock:
            messages, self._waiting = self._waiting, deque()
        yield from self._decoder.lines(b"\n".join(messages))
        if self._lost:
            raise Lost(self._lost)

    def close(self) -> None:
        """Leave the broker."""
        self._client.on_disconnect = None
        self._client.disconnect()
        self._client.loop_stop()


def opener(host: str, port: int, topic: str, decoder: Decoder) -> Any:
    """What a Source opens."""

    def connect(_: Mapping[str, Any]) -> MqttPort:
        return MqttPort(host, port, topic, decoder)

    return connect
