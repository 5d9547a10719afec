"""The windows of a fleet as arrays: which motor, which day, what was found."""

from __future__ import annotations

import dataclasses

import numpy as np
import pyarrow as pa

from .robust import Array, Index

PARAMETERS = ("R_ohm", "Ld_H", "Lq_H", "psi_Wb", "dead_time_V", "J_kgm2", "B_Nms_rad", "coulomb_Nm")
GROUPS = ("type", "batch", "axis", "site", "firmware")
# Of a motor's own residual on the d axis: an angle that is off leaves the magnet's flux there.
D_AXIS = "d_axis"
UNITS = {
    "R_ohm": "Ω",
    "Ld_H": "H",
    "Lq_H": "H",
    "psi_Wb": "Wb",
    "dead_time_V": "V",
    "J_kgm2": "kg m²",
    "B_Nms_rad": "Nms/rad",
    "coulomb_Nm": "Nm",
    D_AXIS: "%",
}


_MOST = 1e12
_LEAST_SD = 1e-9  # of a value: no log tells more


@dataclasses.dataclass(frozen=True)
class Windows:
    """One entry a window. Values that a window does not have are NaN; groups are indices into `labels`."""

    motors: list[str]
    motor: Index
    day: Array
    value: dict[str, Array]
    sd: dict[str, Array]
    usable: dict[str, Array]
    temperature_C: Array
    current_A: Array
    v_dc_V: Array
    group: dict[str, Index]  # of each motor; -1: not said
    labels: dict[str, list[str]]
    pole_pairs: Array  # of each motor


def _numbers(table: pa.Table, name: str) -> Array:
    if name not in table.column_names:
        return np.full(table.num_rows, np.nan)
    x = np.array(table[name].cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)
    # No motor has such, in any of these units, and squares of it are no numbers.
    x[np.abs(x) > _MOST] = np.nan
    return x


def windows_of(table: pa.Table) -> Windows:
    """Of the table that a run writes."""
    names = table["motor"].to_pylist()
    motors = sorted(set(names))
    at = {name: k for k, name in enumerate(motors)}
    motor = np.array([at[name] for name in names], dtype=np.intp)
    value, sd, usable = {}, {}, {}
    for p in PARAMETERS:
        value[p], sd[p] = _numbers(table, p), _numbers(table, f"{p}_sd")
        usable[p] = np.nan_to_num(_numbers(table, f"{p}_usable"))
        sd[p] = np.where(sd[p] > 0, np.maximum(sd[p], _LEAST_SD * np.abs(value[p])), sd[p])
    value[D_AXIS] = _numbers(table, "residual_d_percent")
    sd[D_AXIS], usable[D_AXIS] = value[D_AXIS].copy(), np.ones(len(names))
    group: dict[str, Index] = {}
    labels: dict[str, list[str]] = {}
    for g in GROUPS:
        said = table[g].to_pylist() if g in table.column_names else [None] * len(names)
        labels[g] = sorted({str(x) for x in said if x is not None})
        place = {label: k for k, label in enumerate(labels[g])}
        group[g] = np.full(len(motors), -1, dtype=np.intp)
        for k, x in zip(motor, said, strict=False):
            if x is not None:
                group[g][k] = place[str(x)]
    poles = np.full(len(motors), np.nan)
    said_poles = _numbers(table, "pole_pairs")
    # A coasting log knows of none.
    known = np.isfinite(said_poles)
    poles[motor[known]] = said_poles[known]
    return Windows(
        motors,
        motor,
        _numbers(table, "day"),
        value,
        sd,
        usable,
        _numbers(table, "temp_winding_C"),
        _numbers(table, "i_rms_A"),
        _numbers(table, "v_dc_V"),
        group,
        labels,
        poles,
    )
