"""What a file that dqwatch reads itself says of a window beside its parameters: period, temperature, current, speed."""

from __future__ import annotations

import os

import pyarrow as pa
import pyarrow.csv

NAMES = ("t_s", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "temp_winding_C", "v_dc_V")


def glance(path: str) -> pa.Table | None:
    """Those columns of a container, or of a CSV whose header has dqwatch's names; None where neither can be had so."""
    from dqwatch import _readers

    try:
        if _readers.takes(path):
            columns = _readers.read(path)
            return pa.table({n: columns[n] for n in NAMES if n in columns})
        options = pyarrow.csv.ConvertOptions(
            include_columns=list(NAMES),
            include_missing_columns=True,
            column_types=dict.fromkeys(NAMES, pa.float64()),
            null_values=["", "nan", "NaN", "NAN"],
        )
        table = pyarrow.csv.read_csv(path, convert_options=options)
    # What it says is beside the fit, which tells what is wrong with a file.
    except Exception:
        return None
    kept = [n for n in NAMES if table[n].null_count < table.num_rows]
    return table.select(kept) if "t_s" in kept else None


def machine_beside(path: str) -> str:
    """The machine file beside a log, "" where there is none: what it says of the log stands."""
    beside = os.path.splitext(path)[0] + ".toml"
    return beside if os.path.isfile(beside) else ""
