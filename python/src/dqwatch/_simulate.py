"""Simulated drives: whole runs with arrays for profiles, and runs that are stepped by a controller of one's own."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._errors import UsageError, kind_of
from ._progress import Told, shown
from ._results import Backend, Frozen, Result, frame_of, table_html
from ._source import Machine, add_machine, machine_text

_SIGNALS = ("speed_rad_s", "i_d_A", "i_q_A", "v_d_V", "v_q_V", "load_Nm")
_GROUPS = ("machine", "inverter", "drive", "nonideal", "sensing", "noise", "polled")
_NOMINAL = ("pole_pairs", "R_ohm", "Ld_H", "Lq_H", "psi_Wb", "J_kgm2", "B_Nms_rad")

Array = NDArray[np.float64]
#: A number, an array of one dimension, or a mapping of a signal's parts: value, step, t_step_s, wave, wave_period_s …
Signal = Any


def scenarios() -> dict[str, str]:
    """All simulated drives: name to what it is."""
    return {name: about for name, _, about in _core.scenarios()}


def scenario_keys() -> list[str]:
    """All values of a drive that may be set, by their paths."""
    return list(_core.scenario_keys())


def _text(key: str, value: Any) -> str:
    if isinstance(value, bool | np.bool_):
        return "1" if value else "0"
    if isinstance(value, int | np.integer):
        return str(int(value))
    if isinstance(value, float | np.floating):
        return repr(float(value))
    if isinstance(value, str):
        return value
    raise UsageError(f"{key} is {kind_of(value)}; expected a number or a name")


def _settings(group: str, values: Mapping[str, Any]) -> list[str]:
    """``key=value`` of a mapping, one that is nested by its path."""
    out: list[str] = []
    for key, value in values.items():
        # A signal or a ramp alone stands for its value.
        path = group if key == "value" and group else f"{group}.{key}" if group else str(key)
        out += _settings(path, value) if isinstance(value, Mapping) else [f"{path}={_text(path, value)}"]
    return out


def _array(name: str, values: Any) -> Array:
    try:
        array = np.ascontiguousarray(np.asarray(values), dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise UsageError(f"profile {name}: {error}; expected numbers") from None
    if array.ndim != 1 or array.size == 0:
        raise UsageError(f"profile {name} has the shape {array.shape}; expected one dimension, and not empty")
    if not np.isfinite(array).all():
        raise UsageError(f"profile {name} is not finite at {int(np.argmin(np.isfinite(array)))}; expected numbers")
    return array


@dataclass
class _Profile:
    """A profile as settings, signals that begin from nothing, arrays with their period, and how long they last."""

    settings: list[str] = field(default_factory=list)
    cleared: list[str] = field(default_factory=list)
    tables: list[tuple[str, Array, float]] = field(default_factory=list)
    length_s: float | None = None

    def take(self, profile: Mapping[str, Any], dt_s: float) -> None:
        profile = dict(profile)
        t_s = profile.pop("t_s", None)
        times = None if t_s is None else _array("t_s", t_s)
        if times is not None and not (times.size > 1 and (np.diff(times) > 0).all()):
            raise UsageError("profile t_s does not increase from row to row; expected seconds")
        for name, value in profile.items():
            if name not in _SIGNALS:
                self.settings += _settings("profile", {name: value})
                continue
            self.cleared.append(name)
            if isinstance(value, Mapping):
                self.settings += _settings(f"profile.{name}", value)
            elif np.ndim(value) == 0:
                self.settings.append(f"profile.{name}={_text(name, value)}")
            else:
                self._table(name, _array(name, value), times, dt_s)

    def _table(self, name: str, values: Array, times: Array | None, dt_s: float) -> None:
        if times is not None:
            if times.size != values.size:
                raise UsageError(f"profile {name} has {values.size} rows, t_s {times.size}; expected as many")
            # Between its times a profile is a straight line; every control period sees it there.
            values = np.interp(np.arange(0.0, times[-1] + dt_s, dt_s), times, values)
        self.tables.append((name, np.ascontiguousarray(values), dt_s))
        length_s = values.size * dt_s
        self.length_s = length_s if self.length_s is None else max(self.length_s, length_s)


def _asked(
    machine: Machine | None,
    inverter: Mapping[str, Any] | str | None,
    profile: Mapping[str, Any] | None,
    scenario: str,
    duration_s: float | None,
    seed: int | None,
    polled_Hz: float | None,
    settings: Mapping[str, Any] | None,
    groups: Mapping[str, Mapping[str, Any] | None],
) -> tuple[dict[str, Any], _Profile]:
    asked: dict[str, Any] = {"scenario": scenario}
    said: list[str] = []
    if isinstance(machine, Mapping):
        nominal = {k: v for k, v in machine.items() if k in _NOMINAL}
        if nominal:
            asked["machine_text"] = machine_text(nominal)
        said += _settings("machine", {k: v for k, v in machine.items() if k not in _NOMINAL})
    elif machine is not None:
        add_machine(asked, os.fspath(machine))
    if isinstance(inverter, str):
        asked["modulation"] = inverter
    elif inverter is not None:
        said += _settings("inverter", inverter)
    for group, values in groups.items():
        if values is not None:
            said += _settings(group, values)
    if seed is not None:
        asked["seed"] = int(seed)
    if polled_Hz is not None:
        asked["polled"] = repr(float(polled_Hz))
    laid_out = _Profile()
    if profile is not None:
        laid_out.take(profile, _core.scenario_period_s({**asked, "settings": said}))
    if duration_s is None:
        duration_s = laid_out.length_s
    if duration_s is not None:
        said.append(f"duration_s={float(duration_s)!r}")
    said += laid_out.settings
    if settings is not None:
        said += _settings("", settings)
    asked["settings"] = said
    return asked, laid_out


@dataclass(frozen=True)
class SimResult(Result):
    """A simulated log.

    Attributes
    ----------
    columns : mapping of name to array of shape (rows,)
        ``t_s v_d_V v_q_V i_d_A i_q_A w_m_rad_s theta_e_rad theta_m_rad v_dc_V temp_winding_C temp_magnet_C torque_Nm``;
        ``result["i_q_A"]`` is one of them. It is a log for :func:`dqwatch.fit` and all others
    truth : mapping
        what the machine is, healthy and at its reference temperature
    """

    columns: Mapping[str, Array] = field(default_factory=dict, repr=False)
    truth: Mapping[str, float] = field(default_factory=dict)
    regime: str = ""

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def keys(self) -> Sequence[str]:
        """Names of the columns."""
        return list(self.columns)

    def __len__(self) -> int:
        return int(self.columns["t_s"].size)

    def to_frame(self, backend: Backend = "pandas") -> Any:
        """The log as a frame, one row a row."""
        return frame_of(self.columns, backend)

    def plot(self, axes: Any = None) -> Any:
        """Currents, voltages and speed over time, on three axes of matplotlib; returns them."""
        if axes is None:
            try:
                import matplotlib.pyplot as plt
            except ImportError:
                raise UsageError("no matplotlib for plot(); pip install './python[plot]'") from None
            axes = plt.subplots(3, 1, sharex=True)[1]
        for one, names in zip(axes, (("i_d_A", "i_q_A"), ("v_d_V", "v_q_V"), ("w_m_rad_s",)), strict=True):
            for name in names:
                one.plot(self.columns["t_s"], self.columns[name], label=name)
            one.legend()
        axes[-1].set_xlabel("t, s")
        return axes

    def _repr_html_(self) -> str:
        rows = [(name, f"{c[0]:.6g}", f"{c.min():.6g}", f"{c.max():.6g}") for name, c in self.columns.items() if c.size]
        return f"<p>{len(self)} rows, {self.regime}</p>" + table_html(("column", "first", "least", "largest"), rows)


def _result(done: Mapping[str, Any]) -> SimResult:
    found = json.loads(done["json"])
    rows = found["rows"]
    return SimResult(
        _json=done["json"],
        text=f"{found['scenario']}: {found['regime']}, {rows} rows",
        notes=tuple(done["notes"]),
        columns=Frozen(done["columns"]),
        truth=Frozen(found["truth"]),
        regime=found["regime"],
    )


def simulate(
    machine: Machine | None = None,
    inverter: Mapping[str, Any] | str | None = None,
    profile: Mapping[str, Any] | None = None,
    *,
    scenario: str = "servo",
    drive: Mapping[str, Any] | None = None,
    nonideal: Mapping[str, Any] | None = None,
    sensing: Mapping[str, Any] | None = None,
    noise: Mapping[str, Any] | None = None,
    duration_s: float | None = None,
    seed: int | None = None,
    polled_Hz: float | None = None,
    settings: Mapping[str, Any] | None = None,
    progress: bool | Told | None = None,
) -> SimResult:
    """Simulate a drive: machine, inverter, control, sensors and log.

    Parameters
    ----------
    machine
        values of the machine, ``{"R_ohm": 0.5, "pole_pairs": 7, …}``, or the path of a machine file; what it does not
        say is the scenario's
    inverter
        values of the inverter, ``{"modulation": "centred", "dead_time_s": 1e-6}``, or a modulation's name
    profile
        what the drive is asked to do: ``speed_rad_s`` (reference, or what a load machine imposes), ``i_d_A i_q_A``
        (references), ``v_d_V v_q_V`` (added), ``load_Nm``, each a number, a mapping of a signal's parts, or an array.
        Arrays are taken at ``t_s``, an array of the same length, or one value a control period; between them are
        straight lines, and the last one holds. Beside them ``control`` (speed, current, voltage), ``shaft`` (free,
        imposed) and ``speed_start_rad_s``
    scenario
        the drive that all else stands over; :func:`scenarios` names all
    drive, nonideal, sensing, noise
        values of these groups; ``{"dead_time_V": 4}`` or ``{"turn_short": {"value": 0.05, "t_start_s": 1}}``
    duration_s
        default: as long as the longest array, else the scenario's
    seed
        of noise and random excitation
    polled_Hz
        log as a vendor's tool polls it
    settings
        anything else by its path, ``{"drive.v_dc_V": 48}``; :func:`scenario_keys` names all
    progress
        as in :func:`dqwatch.fit`
    """
    groups = {"drive": drive, "nonideal": nonideal, "sensing": sensing, "noise": noise}
    asked, laid_out = _asked(machine, inverter, profile, scenario, duration_s, seed, polled_Hz, settings, groups)
    with shown(progress) as told:
        return _result(_core.simulate(asked, laid_out.cleared, laid_out.tables, told))


class SimRow(NamedTuple):
    """What a drive sees of one control period; voltages are the means of that period."""

    t_s: float
    v_d_V: float
    v_q_V: float
    i_d_A: float
    i_q_A: float
    w_m_rad_s: float
    theta_e_rad: float
    theta_m_rad: float
    v_dc_V: float
    temp_winding_C: float
    temp_magnet_C: float
    torque_Nm: float


class Simulation:
    """A drive that is stepped by a controller of one's own.

    Arguments as :func:`simulate` has them; the drive's own loops rest, its profile's ``load_Nm`` and ``speed_rad_s``
    (of an imposed shaft) act. ``seen`` is what the sensors say at the start; each :meth:`step` applies a voltage for
    one control period of ``period_s`` and returns what they said when that period began, by which the next voltage is
    decided: a real drive's one period of delay.

    >>> drive = dqwatch.Simulation({"pole_pairs": 4})
    >>> row = drive.seen
    >>> for _ in range(1000):
    ...     row = drive.step(v_d_V=0.0, v_q_V=5.0 * (2.0 - row.i_q_A))
    """

    def __init__(
        self,
        machine: Machine | None = None,
        inverter: Mapping[str, Any] | str | None = None,
        profile: Mapping[str, Any] | None = None,
        *,
        scenario: str = "servo",
        drive: Mapping[str, Any] | None = None,
        nonideal: Mapping[str, Any] | None = None,
        sensing: Mapping[str, Any] | None = None,
        noise: Mapping[str, Any] | None = None,
        seed: int | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> None:
        groups = {"drive": drive, "nonideal": nonideal, "sensing": sensing, "noise": noise}
        resting = {"control": "voltage", "v_d_V": 0.0, "v_q_V": 0.0, **(profile or {})}
        asked, laid_out = _asked(machine, inverter, resting, scenario, None, seed, None, settings, groups)
        self._core = _core.Stepper(asked, laid_out.cleared, laid_out.tables)

    @property
    def seen(self) -> SimRow:
        """What the drive sees now."""
        return SimRow(*self._core.seen)

    @property
    def period_s(self) -> float:
        """The control period."""
        return float(self._core.period_s)

    def step(self, v_d_V: float, v_q_V: float, *, load_Nm: float = 0.0, speed_rad_s: float = 0.0) -> SimRow:
        """Apply a voltage, in the rotating frame of the angle last seen, for one period; the link's limit holds.

        ``load_Nm`` and ``speed_rad_s`` (an imposed shaft's, at the period's end) are added to the profile's.
        """
        try:
            return SimRow(*self._core.step(v_d_V, v_q_V, load_Nm, speed_rad_s))
        except TypeError:
            raise UsageError("a step takes numbers: v_d_V, v_q_V, load_Nm, speed_rad_s") from None

    def log(self) -> Mapping[str, Array]:
        """All rows so far as the drive logs them, noise included: columns by name, a log for all that take one."""
        return Frozen(self._core.log())
