"""A configuration, TOML, to motors, sources and sinks."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dqwatch

from .capture import read_machine
from .core import Live, Sink
from .decode import Decoder, Format, format_of
from .motor import Motor, Settings
from .sources import Source
from .state import slug

_MOTOR = ("machine", "arithmetic", "stall_s", "replayed", "settings")
_SOURCE = ("kind", "name", "motor", "format", "columns", "fields")
_KINDS: dict[str, tuple[str, ...]] = {
    "serial": ("port", "baud"),
    "udp": ("listen",),
    "file": ("path",),
    "mqtt": ("broker", "topic"),
    "can": ("bus", "dbc", "last"),
}
_SINKS: dict[str, tuple[str, ...]] = {"mqtt": ("broker", "prefix"), "parquet": ("folder", "keep_MB")}
#: What a kind needs beyond dqwatch itself, and the extra that has it.
_NEEDS = {"serial": "serial", "can": "can", "mqtt": "paho.mqtt.client"}


class ConfigError(Exception):
    """A configuration that cannot be: one line, with the file and the key."""


def read_config(path: Path) -> dict[str, Any]:
    """The file's. Raises ConfigError."""
    try:
        return tomllib.loads(path.read_text())
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}; expected a configuration (TOML)") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not TOML: {error}") from None


def _table(what: str, x: Any) -> Mapping[str, Any]:
    if not isinstance(x, Mapping):
        raise ConfigError(f"{what}: expected a table, not {x!r}")
    return x


def _tables(what: str, x: Any) -> list[Mapping[str, Any]]:
    if not isinstance(x, list):
        raise ConfigError(f"{what}: expected [[{what}]], one table for each")
    return [_table(f"{what} {k + 1}", t) for k, t in enumerate(x)]


def _known(what: str, table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    for key in table:
        if key not in keys:
            raise ConfigError(f"{what}: unknown {key}; expected {', '.join(keys)}")


def _number(what: str, table: Mapping[str, Any], key: str, usual: float, least: float) -> float:
    """Above ``least``."""
    value = table.get(key, usual)
    if isinstance(value, bool) or not isinstance(value, int | float) or not least < value < float("inf"):
        raise ConfigError(f"{what}: {key} is {value!r}; expected a number above {least:g}")
    return value


def _shown(x: Any) -> str:
    """As TOML has it."""
    return str(x).lower() if isinstance(x, bool) else repr(x)


def _choice(what: str, table: Mapping[str, Any], key: str, choices: tuple[Any, ...]) -> Any:
    """One of them; without it the first."""
    value = table.get(key, choices[0])
    if not any(type(value) is type(c) and value == c for c in choices):
        raise ConfigError(f"{what}: {key} is {value!r}; expected {' or '.join(map(_shown, choices))}")
    return value


def _text(what: str, table: Mapping[str, Any], key: str, usual: str) -> str:
    value = table.get(key, usual)
    if not isinstance(value, str) or not value:
        raise ConfigError(f"{what}: {key} is {value!r}; expected text")
    return value


def _address(what: str, text: Any, port: int) -> tuple[str, int]:
    if not isinstance(text, str):
        raise ConfigError(f"{what}: {text!r}; expected text, HOST:PORT")
    host, _, number = text.rpartition(":")
    if not host:
        host, number = text, str(port)
    if not number.isdigit() or int(number) > 65535:
        raise ConfigError(f"{what}: {text!r}; expected HOST:PORT")
    return host.strip("[]"), int(number)


def _motor(name: str, table: Mapping[str, Any], base: Path, folder: Path | None) -> Motor:
    what = f"motor.{name}"
    table = _table(what, table)
    _known(what, table, _MOTOR)
    machine = table.get("machine")
    try:
        if isinstance(machine, str):
            machine = read_machine(base / machine)
        if not isinstance(machine, Mapping):
            raise ConfigError(f"{what}: no machine; expected the path of a machine file, or a table")
        settings = Settings(
            name=name,
            machine=machine,
            arithmetic=_choice(what, table, "arithmetic", ("float", "q15")),
            stall_s=_number(what, table, "stall_s", 5.0, 0.0),
            replayed=_choice(what, table, "replayed", (False, True)),
            folder=folder,
            extra=dict(_table("settings", table.get("settings", {}))),
        )
        if "period_s" not in settings.machine:
            raise ConfigError(f"{what}: no period_s; expected the seconds from row to row in its machine")
        return Motor(settings)
    except OSError as error:
        raise ConfigError(f"{what}: {error.filename}: {error.strerror or error}") from None
    except (TypeError, ValueError, dqwatch.Error) as error:
        raise ConfigError(f"{what}: {error}") from None


def _format(what: str, table: Mapping[str, Any], motors: Mapping[str, Motor]) -> Format:
    motor = motors.get(str(table.get("motor", "")))
    pole_pairs = int(motor.settings.machine.get("pole_pairs", 1)) if motor else 1
    try:
        columns = _table(f"{what}: columns", table.get("columns", {}))
        made = format_of(str(table.get("format", "json")), pole_pairs, columns)
    except ValueError as error:
        raise ConfigError(f"{what}: {error}") from None
    if "fields" in table and not isinstance(table["fields"], list):
        raise ConfigError(f"{what}: fields: expected a list of names")
    if "fields" in table:
        made.names = tuple(str(f) for f in table["fields"])
    return made


def _source(k: int, table: Mapping[str, Any], base: Path, motors: Mapping[str, Motor]) -> Source:
    kind = str(table.get("kind", ""))
    what = f"source {k + 1}"
    if kind not in _KINDS:
        raise ConfigError(f"{what}: kind {kind!r}; expected {', '.join(_KINDS)}")
    _known(what, table, (*_SOURCE, *_KINDS[kind]))
    for key in _KINDS[kind]:
        if key not in table and key != "baud":
            raise ConfigError(f"{what}: no {key}; a {kind} source needs it")
    name = str(table.get("motor", ""))
    form = _format(what, table, motors)
    if name and name not in motors:
        raise ConfigError(f"{what}: motor {name!r}; expected one of {', '.join(motors)}")
    if not name and (form.kind != "json" or kind in ("can", "file")):
        raise ConfigError(f"{what}: no motor; expected whose rows these are")
    decoder = Decoder(form, name)
    try:
        opened = _opener(what, kind, table, base, decoder)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{what}: {error}") from None
    return Source(str(table.get("name", f"{kind} {k + 1}")), kind, opened, [decoder], motor=name)


def _opener(what: str, kind: str, table: Mapping[str, Any], base: Path, decoder: Decoder) -> Any:
    needed = _NEEDS.get(kind)
    try:
        module = importlib.import_module(f"dqwatch.live.sources.{kind}")
    except ModuleNotFoundError as error:
        raise ConfigError(f"a {kind} source needs {needed or error.name}; pip install './python[live]'") from None
    if kind == "serial":
        baud = int(_number(what, table, "baud", 115200, 0))
        return module.opener(_text(what, table, "port", ""), baud, decoder)
    if kind == "udp":
        host, port = _address("listen", table["listen"], 8601)
        return module.opener(host, port, decoder)
    if kind == "file":
        return module.opener(str(base / _text(what, table, "path", "")), decoder)
    if kind == "mqtt":
        host, port = _address("broker", table["broker"], 1883)
        return module.opener(host, port, _text(what, table, "topic", ""), decoder)
    return module.opener(dict(table["bus"]), str(base / str(table["dbc"])), str(table["last"]), decoder)


def _sink(table: Mapping[str, Any], base: Path) -> Sink:
    kind = str(table.get("kind", ""))
    if kind not in _SINKS:
        raise ConfigError(f"sink {kind!r}; expected {', '.join(_SINKS)}")
    what = f"sink {kind}"
    _known(what, table, ("kind", *_SINKS[kind]))
    try:
        if kind == "mqtt":
            from .sinks.mqtt import MqttSink

            host, port = _address("broker", table.get("broker", "127.0.0.1:1883"), 1883)
            return MqttSink(host, port, _text(what, table, "prefix", "dqwatch"))
        from .sinks.parquet import ParquetSink

        folder = base / _text(what, table, "folder", "")
        return ParquetSink(folder, int(_number(what, table, "keep_MB", 1000, 0) * 1e6))
    except ModuleNotFoundError as error:
        raise ConfigError(f"a {kind} sink needs {error.name}; pip install './python[live]'") from None


def _motors(config: Mapping[str, Any]) -> Mapping[str, Any]:
    motors = config.get("motor", {})
    if isinstance(motors, list):
        raise ConfigError("motor: expected [motor.NAME], not [[motor]]")
    return _table("motor", motors)


def live_of(config: Mapping[str, Any], base: Path) -> tuple[Live, Path | None]:
    """All that the configuration says, and the folder of the logs around events. Raises ConfigError."""
    _known("the configuration", config, ("live", "motor", "source", "sink"))
    table = _table("live", config.get("live", {}))
    _known("[live]", table, ("state", "listen", "token"))
    folder = base / str(table["state"]) if "state" in table else None
    captures = folder / "events" if folder is not None else None
    if captures is not None:
        captures.mkdir(parents=True, exist_ok=True)
    motors = {name: _motor(name, m, base, captures) for name, m in _motors(config).items()}
    if not motors:
        raise ConfigError("no motor; expected [motor.NAME] with machine")
    if len({slug(n) for n in motors}) != len(motors):
        raise ConfigError("two motors whose names cannot be told apart")
    sources = [_source(k, s, base, motors) for k, s in enumerate(_tables("source", config.get("source", [])))]
    if not sources:
        raise ConfigError("no source; expected [[source]] with kind")
    sinks = [_sink(s, base) for s in _tables("sink", config.get("sink", []))]
    return Live(list(motors.values()), sources, sinks, folder), captures
