"""MQTT: `PREFIX/MOTOR/state`, retained, and `PREFIX/MOTOR/event`, JSON. A broker that is gone is found again."""

from __future__ import annotations

import json
from collections import deque
from dataclasses import asdict
from typing import Any

import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion

from ..capture import Block
from ..motor import LiveEvent, Motor
from ..state import slug

MOST_WAITING = 1000


class MqttSink:
    """States are the newest of each motor; events wait in order until the broker has them."""

    name = "mqtt"

    def __init__(self, host: str, port: int, prefix: str) -> None:
        self._where = f"{host}:{port}"
        self._prefix = prefix.rstrip("/")
        self._events: deque[tuple[str, str]] = deque()
        self._states: dict[str, str] = {}
        self._told: dict[str, str] = {}
        self.dropped = 0
        self._connected = False
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2)
        self._client.on_connect = self._here
        self._client.on_disconnect = self._gone
        self._client.reconnect_delay_set(1, 10)
        self._client.max_queued_messages_set(MOST_WAITING)
        self._client.connect_async(host, port, keepalive=10)
        self._client.loop_start()

    def _here(self, *_: Any) -> None:
        # All states anew: the broker may have lost what it retained.
        self._told = {}
        self._connected = True

    def _gone(self, *_: Any) -> None:
        self._connected = False

    def event(self, event: LiveEvent) -> None:
        """Waits for the broker; the oldest goes where too many wait."""
        if len(self._events) >= MOST_WAITING:
            self._events.popleft()
            self.dropped += 1
        self._events.append((f"{self._prefix}/{slug(event.motor)}/event", json.dumps(asdict(event))))

    def tile(self, slug: str, tile: dict[str, Any]) -> None:
        """The newest state replaces the one before."""
        self._states[slug] = json.dumps({k: v for k, v in tile.items() if k != "silent_s"})

    def rows(self, motor: Motor, block: Block, first: int) -> None:
        """Rows are not sent."""

    def keep(self, slug: str) -> None:
        """Nothing of it outlives the program."""

    def step(self, now_s: float) -> None:
        """Send what waits."""
        if not self._connected:
            return
        while self._events and self._taken(*self._events[0]):
            self._events.popleft()
        for motor, text in self._states.items():
            if self._told.get(motor) != text and self._taken(f"{self._prefix}/{motor}/state", text, retain=True):
                self._told[motor] = text

    def _taken(self, topic: str, text: str, retain: bool = False) -> bool:
        """Does the client have it? Not where too many wait in it."""
        taken = self._client.publish(topic, text, qos=1, retain=retain).rc
        return taken in (mqtt.MQTT_ERR_SUCCESS, mqtt.MQTT_ERR_NO_CONN)

    def trouble(self) -> str:
        """No broker, or events that were dropped."""
        lost = f", {self.dropped} events dropped" if self.dropped else ""
        if not self._connected:
            return f"the MQTT broker {self._where} is gone{lost}; {len(self._events)} events wait"
        return lost.lstrip(", ")

    def close(self) -> None:
        """Leave the broker."""
        self._client.on_disconnect = None
        self._client.disconnect()
        self._client.loop_stop()
