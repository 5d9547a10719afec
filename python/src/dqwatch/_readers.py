"""Containers that other libraries read: each comes back as columns by name.

A container may hold several tables (groups of MF4, topics of a bag, groups of HDF5): its *parts*. Unless one is named,
the part with most of a log's own column names is taken, then the one with most columns.
"""

from __future__ import annotations

import importlib
import json
import os
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, UsageError

Columns: TypeAlias = "dict[str, NDArray[Any]]"
Parts: TypeAlias = "dict[str, Columns]"

_OWN = {
    *("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad", "theta_m_rad", "v_dc_V"),
    *("temp_winding_C", "temp_magnet_C", "torque_Nm", "torque_cmd_Nm"),
}
_MAGIC = (
    (b"PAR1", "parquet"),
    (b"MDF     ", "mf4"),
    (b"\x89HDF", "hdf5"),
    (b"\x89MCAP0", "mcap"),
    (b"#ROSBAG", "ros"),
    (b"SQLite format 3", "ros"),
    (b"MATLAB 5.0", "mat"),
    (b"MATLAB 7.3", "hdf5"),
)
_LONGEST = max(len(magic) for magic, _ in _MAGIC)


def _kind(path: str) -> str | None:
    if os.path.isdir(path):
        return "ros" if os.path.isfile(os.path.join(path, "metadata.yaml")) else None
    try:
        # What is no file is read once, and not here.
        if not os.path.isfile(path):
            return None
        with open(path, "rb") as file:
            begin = file.read(_LONGEST)
    except OSError:
        return None
    return next((kind for magic, kind in _MAGIC if begin.startswith(magic)), None)


def takes(path: str) -> bool:
    """True where the file is one of these containers, by its first bytes."""
    return _kind(path) is not None


def _need(module: str, extra: str, path: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise InputError(
            f"{path}: {module.partition('.')[0]} is needed to read it; pip install './python[{extra}]'", file=path
        ) from None


def _numbers(values: Any) -> NDArray[Any] | None:
    """A column, squeezed to one dimension; None where it holds no real numbers."""
    array = np.asarray(values)
    if array.ndim > 1 and max(array.shape) == array.size:
        array = array.reshape(-1)
    return array if array.ndim == 1 and array.dtype.kind in "iufb" else None


def _parquet(path: str) -> Parts:
    table = _need("pyarrow.parquet", "parquet", path).read_table(path)
    columns: Columns = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        values = column.to_numpy()
        columns[name] = values if values.dtype.kind in "iufb" else np.asarray(values, dtype=object)
    return {"": columns}


def _mf4(path: str) -> Parts:
    asammdf = _need("asammdf", "mf4", path)
    parts: Parts = {}
    with asammdf.MDF(path) as mdf:
        for number, group in enumerate(mdf.groups):
            columns: Columns = {}
            times: NDArray[Any] | None = None
            for index, channel in enumerate(group.channels):
                # The group's own clock comes with each of its signals.
                if channel.channel_type in (2, 3):
                    continue
                signal = mdf.get(group=number, index=index)
                values = _numbers(signal.samples)
                if values is None:
                    continue
                # A device's name behind the channel's is not the channel's.
                columns[str(signal.name).partition("\\")[0]] = values
                times = signal.timestamps
            if times is not None:
                columns.setdefault("t_s", np.asarray(times, dtype=np.float64))
                parts[f"group {number}"] = columns
    return parts


def _flatten(message: Any, before: str, to: dict[str, float]) -> None:
    """Numbers of a message by their paths, ``state.current_motor``."""
    if isinstance(message, bool | int | float | np.number):
        to[before] = float(message)
        return
    if isinstance(message, Mapping):
        fields: Iterable[tuple[str, Any]] = message.items()
    else:
        names = getattr(message, "__slots__", None) or list(getattr(message, "__dataclass_fields__", ()))
        fields = [(str(n).lstrip("_"), getattr(message, n, None)) for n in names if not str(n).startswith("__")]
    for name, value in fields:
        _flatten(value, f"{before}.{name}" if before else name, to)


def _stamp_s(row: Mapping[str, float]) -> float | None:
    for fraction in ("nanosec", "nanosecs", "nsec"):
        for seconds in ("sec", "secs"):
            if f"header.stamp.{seconds}" in row and f"header.stamp.{fraction}" in row:
                at = row[f"header.stamp.{seconds}"] + 1e-9 * row[f"header.stamp.{fraction}"]
                return at if at > 0 else None
    return None


def _of_messages(topics: Mapping[str, list[tuple[int, Any]]]) -> Parts:
    """Columns of each topic: a row a message, its time the header's stamp, else when it was recorded."""
    parts: Parts = {}
    for topic, messages in topics.items():
        rows: list[dict[str, float]] = []
        stamps: list[float | None] = []
        for recorded_ns, message in messages:
            row: dict[str, float] = {}
            _flatten(message, "", row)
            stamps.append(_stamp_s(row))
            row["\0"] = 1e-9 * (recorded_ns - messages[0][0])
            rows.append({name: v for name, v in row.items() if not name.startswith("header.")})
        names = list(dict.fromkeys(name for row in rows for name in row if name != "\0"))
        if not names:
            continue
        columns: Columns = {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}
        told = [stamp for stamp in stamps if stamp is not None]
        by_stamp = len(told) == len(rows)
        columns.setdefault("t_s", np.array(told) - told[0] if by_stamp else np.array([row["\0"] for row in rows]))
        parts[topic] = columns
    return parts


def _mcap(path: str) -> Parts:
    reader = _need("mcap.reader", "mcap", path)
    topics: dict[str, list[tuple[int, Any]]] = {}
    decoders: list[Any] = []
    with open(path, "rb") as file:
        made = reader.make_reader(file)
        summary = made.get_summary()
        encodings = {c.message_encoding for c in summary.channels.values()} if summary else {"cdr"}
        if "cdr" in encodings:
            decoders.append(_need("mcap_ros2.decoder", "mcap", path).DecoderFactory())
        decoded = reader.make_reader(file, decoder_factories=decoders)
        for schema, channel, message in decoded.iter_messages():
            if channel.message_encoding == "json":
                value: Any = json.loads(message.data)
            elif channel.message_encoding == "cdr":
                decoder = decoders[0].decoder_for("cdr", schema)
                value = decoder(message.data) if decoder else None
            else:
                continue
            topics.setdefault(channel.topic, []).append((message.log_time, value))
    return _of_messages(topics)


def _ros(path: str) -> Parts:
    from pathlib import Path

    highlevel = _need("rosbags.highlevel", "ros", path)
    folder = Path(path)
    if folder.suffix == ".db3":
        folder = folder.parent
    topics: dict[str, list[tuple[int, Any]]] = {}
    with highlevel.AnyReader([folder]) as reader:
        for connection, stamp_ns, data in reader.messages():
            topics.setdefault(connection.topic, []).append((stamp_ns, reader.deserialize(data, connection.msgtype)))
    return _of_messages(topics)


def _hdf5(path: str) -> Parts:
    h5py = _need("h5py", "hdf5", path)
    parts: Parts = {}
    with h5py.File(path, "r") as file:

        def take(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and item.dtype.names:
                for field in item.dtype.names:
                    values = _numbers(item[field])
                    if values is not None:
                        parts.setdefault(name, {})[field] = values
            elif isinstance(item, h5py.Dataset) and item.dtype.kind in "iufb":
                values = _numbers(item[()])
                if values is not None and values.size > 1:
                    group, _, leaf = name.rpartition("/")
                    parts.setdefault(group, {})[leaf] = values

        file.visititems(take)
    return parts


def _mat(path: str) -> Parts:
    found = _need("scipy.io", "mat", path).loadmat(path, squeeze_me=True, struct_as_record=False)
    parts: Parts = {}
    for name, value in found.items():
        if name.startswith("__"):
            continue
        fields = getattr(value, "_fieldnames", None)
        for leaf, content in [(f, getattr(value, f)) for f in fields] if fields else [(name, value)]:
            values = _numbers(content)
            if values is not None and values.size > 1:
                parts.setdefault(name if fields else "", {})[leaf] = values
    return parts


_READERS = {"parquet": _parquet, "mf4": _mf4, "hdf5": _hdf5, "mcap": _mcap, "ros": _ros, "mat": _mat}


def read(path: str | os.PathLike[str], part: str | None = None) -> Columns:
    """The columns of a Parquet, MF4, MCAP, ROS bag, HDF5 or MAT file by name: a log for all functions that take one.

    Parameters
    ----------
    path
        the file; of a ROS 2 bag its folder. The library that reads it comes with the extra of its name,
        ``pip install './python[mf4]'``: parquet, mf4, mcap, ros, hdf5, mat
    part
        which group of MF4 or HDF5 (MAT: struct), which topic of a bag; default: the one with most of a log's own
        column names, then with most columns

    Time is the column ``t_s`` where the file has a clock beside the columns; columns are as long as the part's longest.
    """
    name = os.fsdecode(os.fspath(path))
    kind = _kind(name)
    if kind is None:
        raise UsageError(f"{name}: no Parquet, MF4, MCAP, ROS bag, HDF5 or MAT; other formats are given by their path")
    try:
        parts = _READERS[kind](name)
    except InputError:
        raise
    except Exception as error:
        # Whatever the library makes of a damaged file.
        raise InputError(f"{name}: cannot be read as {kind}: {type(error).__name__}: {error}", file=name) from error
    if not parts:
        raise InputError(f"{name}: no columns of numbers in it; expected such as t_s, v_d_V, i_q_A", file=name)
    if part is not None:
        if part not in parts:
            raise InputError(f"{name}: no part {part!r}; there are {', '.join(map(repr, parts))}", file=name)
        return _even(parts[part])
    return _even(max(parts.values(), key=lambda c: (len(_OWN & set(c)), len(c))))


def _even(columns: Columns) -> Columns:
    """The columns of the length that most have: the others are settings beside the table."""
    lengths = [column.size for column in columns.values()]
    usual = max(set(lengths), key=lambda n: (lengths.count(n), n))
    return {name: column for name, column in columns.items() if column.size == usual}
