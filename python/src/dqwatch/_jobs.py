"""The command's jobs as functions."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np

from . import _core
from ._progress import Told, shown
from ._results import (
    ColumnsResult,
    CompareResult,
    FitResult,
    MonitorResult,
    TraceResult,
    columns_result,
    compare_result,
    fit_result,
    monitor_result,
    trace_result,
)
from ._source import Machine, Source, add_machine, sources_of

Arithmetic = Literal["float", "q15"]
#: What a trace found: its result, or the path of its trace.json.
Config: TypeAlias = "TraceResult | str | os.PathLike[str]"
_Job: TypeAlias = "Callable[[dict[str, Any], list[tuple[str, _core.Table]], Told | None], dict[str, Any]]"


def _run(
    job: _Job,
    source: Source,
    columns: Mapping[str, Any],
    progress: bool | Told | None,
    *,
    machine: Machine | None,
    config: Config | None = None,
    parameters: Sequence[str] | None = None,
    effects: Sequence[str] | None = None,
    **others: Any,
) -> dict[str, Any]:
    if columns and np.ndim(others.get("v_dc_V", 0.0)) > 0:
        columns = {**columns, "v_dc_V": others.pop("v_dc_V")}  # the link's column, not its one value
    names, tables = sources_of(source, columns)
    asked: dict[str, Any] = {key: value for key, value in others.items() if value is not None}
    asked["logs"] = names
    add_machine(asked, machine)
    if isinstance(config, TraceResult):
        asked["config_text"] = config.to_json()
    elif config is not None:
        asked["config_file"] = os.fsdecode(os.fspath(config))
    for key, several in (("parameters", parameters), ("effects", effects)):
        if several is not None:
            asked[key] = [several] if isinstance(several, str) else list(several)
    with shown(progress) as told:
        return job(asked, tables, told)


def fit(
    source: Source = None,
    *,
    pole_pairs: int | None = None,
    gear: float | None = None,
    v_dc_V: float | None = None,
    period_s: float | None = None,
    format: str | None = None,
    machine: Machine | None = None,
    parameters: Sequence[str] | None = None,
    effects: Sequence[str] | None = None,
    config: Config | None = None,
    progress: bool | Told | None = None,
    **columns: Any,
) -> FitResult:
    """Fit the reference model to a log: parameters with deviations, residual in volts and percent.

    Parameters
    ----------
    source
        a path of any format of ``dqwatch formats`` (packed or not), Parquet, MF4, MCAP, ROS bag, HDF5 or MAT with
        the extra of that name; a pandas or polars frame; anything with ``__arrow_c_stream__``; a mapping of column
        names to arrays of shape (rows,); or a list of these, logs of one machine and one regime.
        Columns have the names of the log format, in SI: ``t_s v_d_V v_q_V i_d_A i_q_A w_m_rad_s``; other names are
        those of a vendor's file, or mapped by ``machine``. Row k holds currents and speed at t_k and the mean voltage
        from t_k to t_{k+1}. NaN is refused where a column needs a number.
    pole_pairs, gear, v_dc_V, period_s
        what the log does not say: number of pole pairs, turns of the rotor for one of the output, volts of the DC
        link (or, beside columns by name, its column), seconds from row to row
    format
        name of the format, where it is not found by itself
    machine
        a machine file's path; or a mapping: values of the machine (``R_ohm``, ``psi_Wb`` …), and its tables "log"
        and "columns" as the file has them. In place of LOG.toml
    parameters
        names of what to estimate; default: what the regime can tell
    effects, config
        effects to estimate as well: names; or a TraceResult or trace.json
    progress
        None: tqdm where somebody watches and it takes over a second; True, False: always, never; a function: called
        with (job, fraction)
    columns
        arrays by name in place of ``source``: ``fit(t_s=t, i_d_A=i_d, …)``

    Returns
    -------
    FitResult

    Raises
    ------
    InputError
        with file and line, or a frame's row, and what was expected
    UsageError
        for an argument or a column that cannot be

    Ctrl-C ends it. Other threads run meanwhile.
    """
    done = _run(
        _core.fit,
        source,
        columns,
        progress,
        machine=machine,
        config=config,
        parameters=parameters,
        effects=effects,
        pole_pairs=pole_pairs,
        gear=gear,
        v_dc_V=v_dc_V,
        period_s=period_s,
        format=format,
    )
    return fit_result(done)


def learn(
    source: Source = None,
    *,
    arithmetic: Arithmetic = "float",
    pole_pairs: int | None = None,
    gear: float | None = None,
    v_dc_V: float | None = None,
    period_s: float | None = None,
    format: str | None = None,
    machine: Machine | None = None,
    parameters: Sequence[str] | None = None,
    effects: Sequence[str] | None = None,
    config: Config | None = None,
    progress: bool | Told | None = None,
    **columns: Any,
) -> FitResult:
    """Run the learners of firmware over a log, in float or in fixed point ("q15").

    Arguments as :func:`fit` has them. With "q15" ``result.q15_config`` is the header that configures firmware.
    """
    done = _run(
        _core.learn,
        source,
        columns,
        progress,
        machine=machine,
        config=config,
        parameters=parameters,
        effects=effects,
        arithmetic=arithmetic,
        pole_pairs=pole_pairs,
        gear=gear,
        v_dc_V=v_dc_V,
        period_s=period_s,
        format=format,
    )
    return fit_result(done)


def trace(
    source: Source = None,
    *,
    effects: Sequence[str] | None = None,
    pole_pairs: int | None = None,
    gear: float | None = None,
    v_dc_V: float | None = None,
    period_s: float | None = None,
    format: str | None = None,
    machine: Machine | None = None,
    progress: bool | Told | None = None,
    **columns: Any,
) -> TraceResult:
    """Find the physical effect that the model of a log lacks; with ``effects`` try those alone.

    Arguments as :func:`fit` has them. Polled logs are traced in looks of
    settled rows, and only for what such looks tell.
    ``result.to_html()`` is the report.
    """
    done = _run(
        _core.trace,
        source,
        columns,
        progress,
        machine=machine,
        effects=effects,
        pole_pairs=pole_pairs,
        gear=gear,
        v_dc_V=v_dc_V,
        period_s=period_s,
        format=format,
    )
    return trace_result(done)


def compare(
    source: Source = None,
    *,
    pole_pairs: int | None = None,
    gear: float | None = None,
    v_dc_V: float | None = None,
    period_s: float | None = None,
    format: str | None = None,
    machine: Machine | None = None,
    parameters: Sequence[str] | None = None,
    effects: Sequence[str] | None = None,
    config: Config | None = None,
    progress: bool | Told | None = None,
    **columns: Any,
) -> CompareResult:
    """Learn one log in float and in fixed point, fit it, and say how far the three are apart.

    Arguments as :func:`fit` has them.
    """
    done = _run(
        _core.compare,
        source,
        columns,
        progress,
        machine=machine,
        config=config,
        parameters=parameters,
        effects=effects,
        pole_pairs=pole_pairs,
        gear=gear,
        v_dc_V=v_dc_V,
        period_s=period_s,
        format=format,
    )
    return compare_result(done)


def monitor(
    source: Source = None,
    *,
    arithmetic: Arithmetic = "float",
    pole_pairs: int | None = None,
    gear: float | None = None,
    v_dc_V: float | None = None,
    period_s: float | None = None,
    format: str | None = None,
    machine: Machine | None = None,
    effects: Sequence[str] | None = None,
    config: Config | None = None,
    progress: bool | Told | None = None,
    **columns: Any,
) -> MonitorResult:
    """Watch a dynamic log for changes of the machine, and name the fault.

    Arguments as :func:`fit` has them; ``config`` has start values and effects to learn. For rows as they come, see
    :class:`Monitor`.
    """
    done = _run(
        _core.monitor,
        source,
        columns,
        progress,
        machine=machine,
        config=config,
        effects=effects,
        arithmetic=arithmetic,
        pole_pairs=pole_pairs,
        gear=gear,
        v_dc_V=v_dc_V,
        period_s=period_s,
        format=format,
    )
    return monitor_result(done)


def columns(
    source: Source = None,
    *,
    pole_pairs: int | None = None,
    gear: float | None = None,
    v_dc_V: float | None = None,
    period_s: float | None = None,
    format: str | None = None,
    machine: Machine | None = None,
    progress: bool | Told | None = None,
    **arrays: Any,
) -> ColumnsResult:
    """Tell what is made of a log, column by column: format, units, factors, rows left out, and what a fit still wants.

    Arguments as :func:`fit` has them, but one log. It says what is missing where ``fit`` refuses.
    """
    done = _run(
        _core.columns,
        source,
        arrays,
        progress,
        machine=machine,
        pole_pairs=pole_pairs,
        gear=gear,
        v_dc_V=v_dc_V,
        period_s=period_s,
        format=format,
    )
    return columns_result(done)
