"""The windows of a simulated fleet without their logs: parameters as a fit would tell them, with its scatter."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from ..work import empty_row, rows_table
from .drive import COPPER_PER_K, MAGNET_PER_K, REFERENCE_C
from .planted import SITES, TYPES, Fleet

# Scatter of a window, measured on polled logs of 3000 rows, and by how much a fit's deviation is wider: that holds what
# an inverter may hide, which like drives share.
SCATTER = {"R_ohm": 0.006, "Lq_H": 0.002, "psi_Wb": 0.0003, "dead_time_V": 0.02, "d_axis": 0.1}
STATED = {"R_ohm": 0.04, "Lq_H": 0.1, "psi_Wb": 0.004, "dead_time_V": 0.15}
_HEAT = 0.0005  # of L at one current


def windows(fleet: Fleet) -> pa.Table:
    """The table that a run over its logs would write, with the papers."""
    rows, papers = [], []
    for k, member in enumerate(fleet.members):
        for week in range(fleet.weeks):
            rng = fleet.random(4, k, week)
            m, wrong = member.week(week, fleet.weeks)
            site = SITES.index(member.site)
            T = 38 + 8 * np.sin(2 * np.pi * (week - 2) / 26) + 3 * site + rng.normal(0, 6)
            i_A = 0.3 * m.i_sat_A * rng.uniform(0.85, 1.15)
            sags = member.site == fleet.sagging_site and week >= fleet.sag_week
            p = m.pole_pairs / TYPES[member.said].pole_pairs
            g, v, w = wrong.current_gain, wrong.voltage_gain, wrong.speed_gain
            value = {
                "R_ohm": m.R_ohm * (1 + COPPER_PER_K * (T - REFERENCE_C)) * v / g,
                "Lq_H": m.Lq_H * (1 - _HEAT * (T - REFERENCE_C)) * (1 - 0.05 * np.log(i_A)) * v / g / w * p,
                "psi_Wb": m.psi_Wb * (1 + MAGNET_PER_K * (T - REFERENCE_C)) * v / w * p * np.cos(wrong.angle_rad),
                "dead_time_V": m.dead_time_V * v * (1 - fleet.sag * sags),
            }
            row = empty_row(
                motor=member.name,
                window=fleet.day(week).isoformat(),
                verdict="good",
                regime="polled",
                why="",
                day=(fleet.day(week).toordinal() - 719163) * 1.0,
                temp_winding_C=T,
                i_rms_A=i_A,
                v_dc_V=m.v_dc_V,
                pole_pairs=float(TYPES[member.said].pole_pairs),
                rows=fleet.rows,
            )
            for name, x in value.items():
                if abs(wrong.angle_rad) > 0.05 and name != "psi_Wb":
                    continue  # the fit does not tell them then
                row[name] = float(x * np.exp(SCATTER[name] * rng.standard_normal()))
                row[f"{name}_sd"] = float(STATED[name] * x)
                row[f"{name}_usable"] = STATED[name] < 1 / 30
            rest = 1.0 + 300 * abs(np.sin(wrong.angle_rad))
            row["residual_d_percent"] = float(rest * np.exp(SCATTER["d_axis"] * rng.standard_normal()))
            rows.append(row)
            papers.append((member.said, member.batch, member.axis, member.site, member.firmware))
            if member.planted == "worn_bearing" or k % 10 == 0:
                coast = empty_row(
                    motor=member.name,
                    window=f"{row['window']}-coast",
                    verdict="good",
                    why="",
                    regime="mechanical",
                    day=row["day"],
                    rows=10000,
                )
                for name, x in (("J_kgm2", m.J_kgm2), ("B_Nms_rad", m.B_Nms_rad), ("coulomb_Nm", m.coulomb_Nm)):
                    coast[name] = float(x * np.exp(0.004 * rng.standard_normal()))
                    coast[f"{name}_sd"], coast[f"{name}_usable"] = 0.004 * x, True
                rows.append(coast)
                papers.append(papers[-1])
    table = rows_table(rows)
    for name, values in zip(("type", "batch", "axis", "site", "firmware"), zip(*papers, strict=False), strict=False):
        table = table.append_column(name, pa.array(values, pa.string()))
    return table
