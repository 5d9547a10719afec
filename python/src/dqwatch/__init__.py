"""Learns the parameters of a permanent-magnet motor from its logs, finds what its model lacks, watches it for faults.

>>> import dqwatch
>>> result = dqwatch.fit("log.csv", pole_pairs=4)
>>> result.parameters["psi_Wb"].value, result.parameters["psi_Wb"].sd

:func:`fit`, :func:`learn`, :func:`trace`, :func:`compare` and :func:`monitor` take a log: a path, a frame, an Arrow
stream, or arrays by name; :func:`columns` says how it is read. :class:`Monitor` and :class:`Estimator` take rows
as they come. :func:`simulate` and :class:`Simulation` make logs. All quantities are SI, and their names say so.
"""

from __future__ import annotations

from ._core import version as __version__
from ._errors import Error, InputError, UsageError
from ._jobs import columns, compare, fit, learn, monitor, trace
from ._readers import read
from ._results import (
    Column,
    ColumnsResult,
    CompareResult,
    Dropped,
    Effect,
    Event,
    FitResult,
    MonitorResult,
    NotIdentifiable,
    Parameter,
    TraceResult,
)
from ._simulate import SimResult, SimRow, Simulation, scenario_keys, scenarios, simulate
from ._streams import Estimator, Monitor

__all__ = [
    "Column",
    "ColumnsResult",
    "CompareResult",
    "Dropped",
    "Effect",
    "Error",
    "Estimator",
    "Event",
    "FitResult",
    "InputError",
    "Monitor",
    "MonitorResult",
    "NotIdentifiable",
    "Parameter",
    "SimResult",
    "SimRow",
    "Simulation",
    "TraceResult",
    "UsageError",
    "__version__",
    "columns",
    "compare",
    "fit",
    "learn",
    "monitor",
    "read",
    "scenario_keys",
    "scenarios",
    "simulate",
    "trace",
]


def __getattr__(name: str) -> object:
    """``dqwatch.fleet`` is there when it is asked for: it needs more than numpy."""
    if name == "fleet":
        import importlib

        return importlib.import_module("dqwatch.fleet")
    raise AttributeError(f"module 'dqwatch' has no attribute {name!r}")
