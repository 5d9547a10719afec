"""What a log may be given as: a path, a frame, an Arrow stream, arrays by name; and its way to the compiled part."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from . import _core, _readers
from ._errors import UsageError, kind_of

Path: TypeAlias = "str | os.PathLike[str]"
#: A path; a pandas or polars frame; anything with ``__arrow_c_stream__``; a mapping of names to arrays.
Source: TypeAlias = Any
#: Values under [machine], or whole tables "machine", "log", "columns", or the path of a machine file.
Machine: TypeAlias = "Mapping[str, Any] | str | os.PathLike[str]"

_TABLES = ("machine", "log", "columns")


def _column(name: str, values: Any) -> Any:
    """One column as an array of numbers, or the name of its type."""
    if isinstance(values, str | bytes):
        raise UsageError(f"column {name} is text; expected one number a row")
    try:
        if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "iufb":
            values = (
                np.ma.filled(values, False)
                if values.dtype.kind == "b"
                else np.ma.filled(values.astype(np.float64), np.nan)
            )
        array = np.asarray(values)
    except (ValueError, TypeError) as error:
        raise UsageError(f"column {name} is no array: {error}; expected one number a row") from None
    if array.ndim != 1:
        raise UsageError(f"column {name} has {array.ndim} dimensions; expected one number a row")
    if array.dtype == np.float16 or (array.dtype.kind in "iufb" and not array.dtype.isnative):
        array = array.astype(np.float64)
    if array.dtype.kind not in "iufb" or array.dtype.itemsize > 8:
        return str(array.dtype)
    return array


def _pandas_column(series: Any) -> Any:
    """A pandas column: a view where it holds plain numbers; missing values become NaN."""
    if isinstance(series.dtype, np.dtype):
        return series.to_numpy()
    if series.dtype.kind == "b":
        return series.to_numpy(dtype=np.bool_, na_value=False)
    if getattr(series.dtype, "_is_numeric", False):
        return series.to_numpy(dtype=np.float64, na_value=np.nan)
    return str(series.dtype)


def _of_columns(columns: Iterable[tuple[str, Any]]) -> _core.Table:
    # A name that is no UTF-8 is shown with what can be shown of it.
    named = ((name.encode(errors="replace").decode(), values) for name, values in columns)
    return _core.arrays([(n, v if isinstance(v, str) else _column(n, v)) for n, v in named])


def table_of(source: Source) -> _core.Table:
    """A frame, a stream or arrays by name as a table; raises UsageError on anything else."""
    if hasattr(source, "collect"):
        raise UsageError(f"a log cannot be {kind_of(source)}; expected .collect() first")
    if isinstance(getattr(source, "columns", None), Mapping):
        source = source.columns  # a SimResult
    if isinstance(source, Mapping):
        if not source:
            raise UsageError("no columns; expected arrays such as t_s, v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s")
        return _of_columns((str(name), _not_text(str(name), values)) for name, values in source.items())
    if type(source).__module__.partition(".")[0] == "pandas" and hasattr(source, "columns"):
        return _of_columns((str(name), _pandas_column(source.iloc[:, k])) for k, name in enumerate(source.columns))
    if hasattr(source, "__arrow_c_stream__"):
        rows = 0
        if hasattr(source, "__len__"):
            rows = len(source)
        elif isinstance(getattr(source, "num_rows", None), int):
            rows = source.num_rows
        return _core.stream(source.__arrow_c_stream__(), rows)
    if isinstance(source, np.ndarray) and source.dtype.names:
        return _of_columns((name, source[name]) for name in source.dtype.names)
    raise UsageError(f"a log cannot be {kind_of(source)}; expected a path, a frame, or arrays by name")


def _not_text(name: str, values: Any) -> Any:
    if isinstance(values, str | bytes):
        raise UsageError(f"column {name} is text; expected one number a row")
    return values


def sources_of(source: Source, columns: Mapping[str, Any]) -> tuple[list[str], list[tuple[str, _core.Table]]]:
    """Names of all logs, and the tables of those that are no files."""
    if columns:
        if source is not None:
            named = ", ".join(columns)
            raise UsageError(f"a log and columns by name ({named}); expected one of them, or an option's name")
        source = dict(columns)
    if source is None:
        raise UsageError("no log; expected a path, a frame, or arrays by name")
    several = isinstance(source, Sequence) and not isinstance(source, str | bytes)
    given = list(source) if several else [source]
    if not given:
        raise UsageError("an empty list of logs; expected at least one")
    names: list[str] = []
    tables: list[tuple[str, _core.Table]] = []
    for number, one in enumerate(given, 1):
        if isinstance(one, str | os.PathLike):
            path = os.fsdecode(os.fspath(one))
            if not _readers.takes(path):
                names.append(path)
                continue
            name, table = path, table_of(_readers.read(path))
        else:
            kind = "arrays" if isinstance(one, Mapping) else "frame"
            name, table = kind if len(given) == 1 else f"{kind} {number}", table_of(one)
        names.append(name)
        tables.append((name, table))
    return names, tables


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(k))} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, int | np.integer):
        return str(int(value))
    if isinstance(value, float | np.floating):
        return repr(float(value))
    if isinstance(value, Sequence):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    raise UsageError(f"{kind_of(value)} in the machine; expected numbers, texts and mappings of them")


def machine_text(machine: Mapping[str, Any]) -> str:
    """A machine file's text: keys "machine", "log" and "columns" are its tables, all others stand under [machine]."""
    tables: dict[str, dict[str, Any]] = {name: {} for name in _TABLES}
    for key, value in machine.items():
        if key in _TABLES and isinstance(value, Mapping):
            tables[key].update(value)
        else:
            tables["machine"][str(key)] = value
    return "".join(
        f"[{name}]\n" + "".join(f"{json.dumps(str(k))} = {_toml(v)}\n" for k, v in table.items())
        for name, table in tables.items()
        if table
    )


def add_machine(asked: dict[str, Any], machine: Machine | None) -> None:
    """Puts a machine file, or what stands for one, among the options; of one container LOG.toml beside it."""
    if machine is None:
        logs = asked.get("logs", [])
        beside = os.path.splitext(logs[0])[0] + ".toml" if len(logs) == 1 and _readers.takes(logs[0]) else ""
        if beside and os.path.isfile(beside):
            asked["machine_file"] = beside
        return
    if isinstance(machine, Mapping):
        # A comment keeps an empty one from meaning none.
        asked["machine_text"] = "# dqwatch\n" + machine_text(machine)
    else:
        asked["machine_file"] = os.fsdecode(os.fspath(machine))
