"""A monitor and an estimator that are fed a row or a block at a time, as firmware feeds them."""

from __future__ import annotations

import hashlib
import json
import math
import os
import tomllib
from collections.abc import Mapping
from typing import Any, ClassVar, Self

from . import _core
from ._errors import InputError, UsageError, kind_of
from ._jobs import Arithmetic, Config
from ._results import Event, Frozen, Parameter, TraceResult, event_of, unit_of
from ._source import Machine, Source, add_machine, sources_of, table_of

_NAN = math.nan
_ALIASES = {"v_V": "v_base_V", "i_A": "i_base_A", "w_m_rad_s": "w_base_rad_s", "dt_s": "period_s"}
#: What a machine file says beside a monitor's configuration.
_OTHER = ("name", "B_Nms_rad", "torque_constant_Nm_A", "gear", "v_dc_V")
_NEEDED = {
    "period_s": "seconds from row to row",
    "v_base_V": "rated phase voltage, peak, as v_V",
    "i_base_A": "rated phase current, peak, as i_A",
    "w_base_rad_s": "highest mechanical speed, as w_m_rad_s",
}


def _read(path: str) -> dict[str, Any]:
    """What a file says of a machine: TOML with [machine] and [nameplate], or JSON, a result of dqwatch among them."""
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be opened: {error.strerror}; expected TOML or JSON", file=path) from None
    try:
        found = json.loads(data) if data.lstrip()[:1] == b"{" else tomllib.loads(data.decode())
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: neither TOML nor JSON: {error}; expected a machine file", file=path) from None
    return _flat(found)


def _flat(found: Mapping[str, Any]) -> dict[str, Any]:
    """One mapping of what stands in tables; parameters of a result are its values."""
    values: dict[str, Any] = {}
    parameters = found.get("parameters") or found.get("after", {}).get("parameters")
    if parameters is not None and "schema" in found:
        values.update({name: p["value"] for name, p in parameters.items() if p.get("value") is not None})
        if "inputs" in found:
            values["inputs"] = found["inputs"]
        return {key: value for key, value in values.items() if key not in _OTHER}
    for key, value in found.items():
        if key in ("machine", "nameplate", "log") and isinstance(value, Mapping):
            values.update(_log_keys(value) if key == "log" else value)
        elif key != "columns":
            values[key] = value
    return {_ALIASES.get(key, key): value for key, value in values.items() if key not in _OTHER}


def _log_keys(table: Mapping[str, Any]) -> dict[str, Any]:
    kept = {k: table[k] for k in ("period_s", "modulation", "voltage_error_V") if k in table}
    if table.get("angle") == "observer":
        kept["observed"] = True
    if "voltage_scale" in table:
        kept["voltage_scale_ppm"] = round(1e6 * table["voltage_scale"])
    return kept


def _setup(machine: Machine, given: Mapping[str, Any]) -> str:
    values = _flat(machine) if isinstance(machine, Mapping) else _read(os.fsdecode(os.fspath(machine)))
    values.update({_ALIASES.get(key, key): value for key, value in given.items() if value is not None})
    missing = [f"{key} ({what})" for key, what in _NEEDED.items() if key not in values]
    if missing:
        raise UsageError(f"the machine lacks {', '.join(missing)}; expected them in it, or as arguments")
    try:
        return json.dumps(values, default=_plain)
    except TypeError as error:
        raise UsageError(f"the machine: {error}; expected numbers, texts and mappings of them") from None


def _plain(value: Any) -> Any:
    if hasattr(value, "item"):
        return value.item()
    raise TypeError(f"{kind_of(value)} in it")


class _Stream:
    """What monitor and estimator share."""

    _kind: ClassVar[str]
    _core_type: ClassVar[Any]

    def __init__(
        self,
        machine: Machine,
        *,
        period_s: float | None = None,
        arithmetic: Arithmetic = "float",
        v_V: float | None = None,
        i_A: float | None = None,
        w_m_rad_s: float | None = None,
        config: Config | None = None,
        **settings: Any,
    ) -> None:
        given: dict[str, Any] = dict(settings)
        if config is not None:
            traced = (
                _flat(json.loads(config.to_json()))
                if isinstance(config, TraceResult)
                else _read(os.fsdecode(os.fspath(config)))
            )
            given = {**traced, **given}
        given.update(period_s=period_s, v_V=v_V, i_A=i_A, w_m_rad_s=w_m_rad_s)
        self._begin(_setup(machine, given), arithmetic)

    def _begin(self, setup: str, arithmetic: str) -> None:
        if arithmetic not in ("float", "q15"):
            raise UsageError(f"arithmetic {arithmetic!r}; expected 'float' or 'q15'")
        self._arithmetic = arithmetic
        self._core = self._core_type(setup, arithmetic == "q15")

    @property
    def arithmetic(self) -> str:
        """ "float" or "q15"."""
        return self._arithmetic

    @property
    def rows(self) -> int:
        """Rows that were taken."""
        return int(self._core.rows)

    @property
    def t_s(self) -> float:
        """Time of the last row."""
        return float(self._core.t_s)

    def settings(self) -> dict[str, Any]:
        """The configuration, whole: what another may be made of."""
        found: dict[str, Any] = json.loads(self._core.setup())
        return found

    def status(self) -> dict[str, Any]:
        """Where it is now.

        Keys: ``stage``, ``in_service``, ``blocks`` learned, ``residual_pu`` of the voltage base, ``rows``, ``t_s``,
        ``refused`` (counts: not_finite, saturated, stuck, incomplete_blocks) and ``parameters``: by name, unit as
        suffix, with ``value`` and ``sd`` (None: not known).
        A monitor's channels have ``healthy``, ``band`` (a smaller change is healthy, in the unit of the name),
        ``least_change`` that would be told now, ``watched``, and ``why`` not.
        An estimator's have ``usable``; beside them stands ``pole_pairs``.
        """
        found: dict[str, Any] = json.loads(self._core.status())
        found["rows"] = self.rows
        found["t_s"] = self.t_s
        return found

    def state(self) -> bytes:
        """All of its state, for :meth:`from_state` in the same version of dqwatch on the same kind of machine."""
        image: bytes = self._core.state()
        head = {
            "kind": self._kind,
            "build": _core.build,
            "arithmetic": self._arithmetic,
            "setup": self._core.setup(),
        }
        body = json.dumps(head).encode() + b"\n" + image
        return b"dqwatch state 1 " + hashlib.sha256(body).hexdigest().encode() + b"\n" + body

    @classmethod
    def from_state(cls, state: bytes) -> Self:
        """One that goes on, to the bit, where the one of that state was.

        Raises InputError for what is damaged, of another kind, or of another build of dqwatch.
        """
        if not isinstance(state, bytes | bytearray | memoryview):
            raise UsageError(f"{kind_of(state)}; expected the bytes of state()")
        head_line, _, body = bytes(state).partition(b"\n")
        words = head_line.split(b" ")
        if words[:2] != [b"dqwatch", b"state"] or len(words) != 4:
            raise InputError("no state of dqwatch; expected the bytes of state()")
        if words[2] != b"1":
            raise InputError(f"a state of version {words[2].decode('ascii', 'replace')}; expected version 1")
        if hashlib.sha256(body).hexdigest().encode() != words[3]:
            raise InputError("a damaged state: its check sum is another; expected the bytes of state(), all of them")
        head_text, _, image = body.partition(b"\n")
        head = json.loads(head_text)
        if head["kind"] != cls._kind:
            raise InputError(f"the state of a {head['kind']}; expected that of a {cls._kind}")
        if head["build"] != _core.build:
            raise InputError(f"a state of {head['build']}, this is {_core.build}; expected one of this build")
        made = cls.__new__(cls)
        made._begin(head["setup"], head["arithmetic"])
        if not made._core.take_state(image):
            raise InputError("a state that does not fit its configuration; expected the bytes of state()")
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).from_state, (self.state(),)

    def _step(
        self,
        i_d_A: float,
        i_q_A: float,
        v_d_V: float,
        v_q_V: float,
        w_m_rad_s: float,
        theta_e_rad: float | None,
        t_s: float | None,
        temp_winding_C: float | None,
        temp_magnet_C: float | None,
    ) -> list[str]:
        try:
            told: list[str] = self._core.step(
                _NAN if t_s is None else t_s,
                v_d_V,
                v_q_V,
                i_d_A,
                i_q_A,
                w_m_rad_s,
                _NAN if theta_e_rad is None else theta_e_rad,
                _NAN if temp_winding_C is None else temp_winding_C,
                _NAN if temp_magnet_C is None else temp_magnet_C,
            )
        except TypeError:
            raise UsageError("a row takes one number for each of its signals") from None
        return told

    def _block(self, source: Source, columns: Mapping[str, Any]) -> list[str]:
        if (source is None) != bool(columns):
            raise UsageError("a block is a frame, or arrays by name; expected one of them")
        told: list[str] = self._core.block(table_of(dict(columns) if source is None else source))
        return told

    def __repr__(self) -> str:
        return f"<dqwatch.{type(self).__name__} {self._arithmetic}, {self.rows} rows>"


class Monitor(_Stream):
    """The condition monitor: learns the healthy machine from its rows, then tells what has changed.

    Parameters
    ----------
    machine
        a mapping, or the path of TOML ([machine], [nameplate]) or JSON (a fit's or a trace's among them). Needed,
        there or as arguments: ``pole_pairs``, ``period_s``, ``v_V`` (rated phase voltage, peak), ``i_A`` (rated phase
        current, peak), ``w_m_rad_s`` (highest mechanical speed). Known values start the learning:
        ``R_ohm Ld_H Lq_H psi_Wb``;
        ``J_kgm2`` has friction watched
    period_s
        seconds from row to row
    arithmetic
        "float" (lib/) or "q15" (port_q15/)
    config
        a TraceResult or trace.json: effects to learn as well
    settings
        of firmware's configuration: ``angle`` (theta_e_rad is given; default True), ``voltage_next`` (a row's voltage
        acts one period later), ``voltage_held`` (it is a vector held in the stationary frame), ``observed`` (the angle
        is an observer's), ``voltage_error_V``, ``voltage_scale_ppm``, ``modulation`` (name), ``band`` (mapping of
        channels; as part of the healthy value or of the base), ``alpha_per_K``, ``beta_per_K``, ``heating_K_s``,
        ``commissioned``,
        ``half_window``, ``stale_limit``, ``threshold_ppm``, ``encoder_offset``, ``noise_on_inputs``, ``follow``,
        ``v_limit_V``, ``i_limit_A``, ``excitation_pu``, ``dead_time_width_A``, ``angle_late_s``

    Rows are SI; what is not finite is skipped and counted (``status()["refused"]``), and so is a row without an angle
    where one is configured. It is pickled, and goes on to the bit. One call at a time; other threads run during
    :meth:`block`.
    """

    _kind = "monitor"
    _core_type = _core.MonitorStream

    @classmethod
    def for_log(
        cls,
        source: Source = None,
        *,
        arithmetic: Arithmetic = "float",
        pole_pairs: int | None = None,
        machine: Machine | None = None,
        effects: list[str] | None = None,
        **columns: Any,
    ) -> Self:
        """One that is configured as :func:`dqwatch.monitor` configures itself for this log; it has seen no row yet."""
        names, tables = sources_of(source, columns)
        asked: dict[str, Any] = {"logs": names}
        if pole_pairs is not None:
            asked["pole_pairs"] = pole_pairs
        if effects is not None:
            asked["effects"] = list(effects)
        add_machine(asked, machine)
        made = cls.__new__(cls)
        made._begin(_core.monitor_setup(asked, tables, None), arithmetic)
        return made

    def step(
        self,
        *,
        i_d_A: float,
        i_q_A: float,
        v_d_V: float,
        v_q_V: float,
        w_m_rad_s: float,
        theta_e_rad: float | None = None,
        t_s: float | None = None,
        temp_winding_C: float | None = None,
        temp_magnet_C: float | None = None,
    ) -> list[Event]:
        """One row: currents, speed and angle at its time, the mean voltage from it to the next. Returns what is told.

        ``t_s`` says where rows are missing; without it each is a period after the last.
        """
        told = self._step(i_d_A, i_q_A, v_d_V, v_q_V, w_m_rad_s, theta_e_rad, t_s, temp_winding_C, temp_magnet_C)
        return [event_of(line) for line in told]

    def block(self, source: Source = None, **columns: Any) -> list[Event]:
        """Rows in order: a frame, an Arrow stream, or arrays of one length by name as :meth:`step` has them."""
        return [event_of(line) for line in self._block(source, columns)]


class Estimator(_Stream):
    """The estimator alone: R, L_d, L_q, flux, dead time and the encoder's angle, learned from rows as they come.

    Arguments and rows as :class:`Monitor` has them; ``pole_pairs`` may be left out, and are then found.
    """

    _kind = "estimator"
    _core_type = _core.EstimatorStream

    def step(
        self,
        *,
        i_d_A: float,
        i_q_A: float,
        v_d_V: float,
        v_q_V: float,
        w_m_rad_s: float,
        theta_e_rad: float | None = None,
        t_s: float | None = None,
        temp_winding_C: float | None = None,
        temp_magnet_C: float | None = None,
    ) -> None:
        """One row, as :meth:`Monitor.step` has it."""
        self._step(i_d_A, i_q_A, v_d_V, v_q_V, w_m_rad_s, theta_e_rad, t_s, temp_winding_C, temp_magnet_C)

    def block(self, source: Source = None, **columns: Any) -> None:
        """Rows in order, as :meth:`Monitor.block` has them."""
        self._block(source, columns)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """What is known now, by name; ``psi_q_Wb`` over ``psi_Wb`` is the angle by which the encoder is off."""
        return Frozen(
            {
                name: Parameter(
                    name=name,
                    value=r["value"],
                    sd=r["sd"],
                    unit=unit_of(name),
                    usable=r["usable"],
                    why="" if r["usable"] else "its deviation is too large, or its sign is wrong",
                )
                for name, r in self.status()["parameters"].items()
                if r["sd"] is not None
            }
        )
