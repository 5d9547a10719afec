"""Values that no motor has, in a table of windows: compared without complaint, and a page that can be opened."""

import json
import re
import warnings

import numpy as np
import pyarrow as pa
import pytest

from dqwatch.fleet.compare import compare
from dqwatch.fleet.page import page
from dqwatch.fleet.simulated.planted import drawn
from dqwatch.fleet.simulated.short import windows
from dqwatch.fleet.windows import windows_of

EXTREMES = [np.inf, 0.0, 1e300, 5e-324]
NUMBERS = ["R_ohm", "R_ohm_sd", "psi_Wb", "psi_Wb_sd", "Lq_H_sd", "temp_winding_C", "i_rms_A", "residual_d_percent"]


def with_values(table, name, at, value):
    x = table[name].to_numpy(zero_copy_only=False).astype(float).copy()
    x[at] = value
    return table.set_column(table.column_names.index(name), name, pa.array(x))


@pytest.fixture(scope="module")
def fleet():
    table = windows(drawn(11, 120, each=1, batch=5))
    return table, {s.motor: s.cause for s in compare(windows_of(table)).standing}


@pytest.mark.parametrize("name", NUMBERS)
def test_motors_nonsense_moves_no_other(name, fleet):
    changed, before = fleet
    motors = np.array(changed["motor"].to_pylist())
    healthy = sorted(set(motors) - set(before))[7 : 7 + len(EXTREMES)]
    for k, (motor, value) in enumerate(zip(healthy, EXTREMES, strict=True)):
        # Of all its windows, or of one.
        changed = with_values(changed, name, np.flatnonzero(motors == motor)[: 1 if k % 2 else None], value)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        w = windows_of(changed)
        c = compare(w)
    text = page(w, c, changed)
    island = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S).group(1)
    assert json.loads(island)["motors"] == w.motors
    # What stands out of the others is what stood out.
    assert {s.motor: s.cause for s in c.standing if s.motor not in healthy} == before
