"""A log is the same log however it comes; what cannot be one is refused with its column, its row, and what to do."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dqwatch

NAMES = ("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s")
MACHINE = {"pole_pairs": 4, "log": {"regime": "dynamic"}}
PLATE = {"period_s": 1e-4, "v_V": 180.0, "i_A": 10.0, "w_m_rad_s": 150.0}


@pytest.fixture(scope="module")
def arrays(servo: dqwatch.SimResult) -> dict[str, Any]:
    return {name: servo[name] for name in NAMES}


def values(result: dqwatch.FitResult) -> dict[str, tuple[float, float | None]]:
    return {name: (p.value, p.sd) for name, p in result.parameters.items()}


@pytest.fixture(scope="module")
def expected(arrays: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """By a file of all digits."""
    path = tmp_path_factory.mktemp("log") / "log.csv"
    rows = zip(*(arrays[name].tolist() for name in NAMES), strict=True)
    path.write_text(",".join(NAMES) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    return values(dqwatch.fit(path, machine=MACHINE))


def test_arrays(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    assert values(dqwatch.fit(arrays, machine=MACHINE)) == expected
    assert values(dqwatch.fit(machine=MACHINE, **arrays)) == expected


def test_lists(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    assert values(dqwatch.fit({n: a.tolist() for n, a in arrays.items()}, machine=MACHINE)) == expected


def test_views_with_strides(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    table = np.array([arrays[n] for n in NAMES]).T.copy()
    assert values(dqwatch.fit({n: table[:, k] for k, n in enumerate(NAMES)}, machine=MACHINE)) == expected
    backwards = {n: a[::-1].copy()[::-1] for n, a in arrays.items()}
    assert values(dqwatch.fit(backwards, machine=MACHINE)) == expected


def test_other_byte_order(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    assert values(dqwatch.fit({n: a.astype(">f8") for n, a in arrays.items()}, machine=MACHINE)) == expected


def test_structured(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    table = np.zeros(arrays["t_s"].size, dtype=[(n, "f8") for n in NAMES])
    for name in NAMES:
        table[name] = arrays[name]
    assert values(dqwatch.fit(table, machine=MACHINE)) == expected


def test_float32(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    narrow = {n: a if n == "t_s" else a.astype(np.float32) for n, a in arrays.items()}
    for name, (value, _) in values(dqwatch.fit(narrow, machine=MACHINE)).items():
        assert value == pytest.approx(expected[name][0], rel=1e-4)


def test_pandas(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(arrays)
    assert values(dqwatch.fit(frame, machine=MACHINE)) == expected
    assert values(dqwatch.fit(frame.assign(note="text"), machine=MACHINE)) == expected
    assert values(dqwatch.fit(frame.astype("Float64"), machine=MACHINE)) == expected


def test_polars(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(arrays)
    assert values(dqwatch.fit(frame, machine=MACHINE)) == expected
    halves = polars.concat([frame[:1234], frame[1234:]], rechunk=False)
    assert values(dqwatch.fit(halves, machine=MACHINE)) == expected
    with pytest.raises(dqwatch.UsageError, match="collect"):
        dqwatch.fit(frame.lazy(), machine=MACHINE)


def test_arrow(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    pa = pytest.importorskip("pyarrow")
    table = pa.table(arrays)
    assert values(dqwatch.fit(table, machine=MACHINE)) == expected
    padded = pa.concat_tables([table[:7], table])
    assert values(dqwatch.fit(padded[7:], machine=MACHINE)) == expected
    reader = pa.RecordBatchReader.from_batches(table.schema, table.to_batches(max_chunksize=100))
    assert values(dqwatch.fit(reader, machine=MACHINE)) == expected


def test_a_closed_stream(arrays: dict[str, Any]) -> None:
    pa = pytest.importorskip("pyarrow")
    capsule = pa.table(arrays).__arrow_c_stream__()

    class Once:
        def __arrow_c_stream__(self, requested_schema: object = None) -> object:
            return capsule

    dqwatch.fit(Once(), machine=MACHINE)
    with pytest.raises(dqwatch.UsageError, match="closed"):
        dqwatch.fit(Once(), machine=MACHINE)


def test_a_stream_that_fails(arrays: dict[str, Any]) -> None:
    pa = pytest.importorskip("pyarrow")
    batches = pa.table(arrays).to_batches(max_chunksize=100)

    def some() -> Any:
        yield batches[0]
        raise ValueError("the disk is gone")

    reader = pa.RecordBatchReader.from_batches(batches[0].schema, some())
    with pytest.raises(dqwatch.Error, match="the disk is gone"):
        dqwatch.fit(reader, machine=MACHINE)


def test_nulls_of_arrow(arrays: dict[str, Any]) -> None:
    pa = pytest.importorskip("pyarrow")
    holes = [None if k == 321 else x for k, x in enumerate(arrays["i_d_A"].tolist())]
    with pytest.raises(dqwatch.InputError, match=r"row 321: i_d_A is nan") as caught:
        dqwatch.fit(pa.table({**arrays, "i_d_A": holes}), machine=MACHINE)
    assert caught.value.row == 321 and caught.value.file is None and caught.value.line is None


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite(arrays: dict[str, Any], bad: float) -> None:
    holed = arrays["v_q_V"].copy()
    holed[17] = bad
    with pytest.raises(dqwatch.InputError, match="row 17: v_q_V") as caught:
        dqwatch.fit({**arrays, "v_q_V": holed}, machine=MACHINE)
    assert caught.value.row == 17 and "finite" in caught.value.advice


@pytest.mark.parametrize(
    ("column", "word"),
    [
        (["a"] * 5000, "<U1"),
        ([object()] * 5000, "object"),
        (np.ones(5000, dtype=np.complex128), "complex128"),
        (np.zeros(5000, dtype="datetime64[ns]"), "datetime64"),
        (np.zeros(5000, dtype=np.longdouble), "float"),
        (np.ones((5000, 2)), "dimensions"),
        ("text", "text"),
        (3.0, "dimensions"),
        ([[1.0], [1.0, 2.0]], "array"),
    ],
)
def test_columns_of_no_numbers(arrays: dict[str, Any], column: Any, word: str) -> None:
    with pytest.raises(dqwatch.Error, match="i_q_A") as caught:
        dqwatch.fit({**arrays, "i_q_A": column}, machine=MACHINE)
    assert word in str(caught.value) and caught.value.advice


def _frames(columns: dict[str, Any]) -> list[Any]:
    """The same columns as arrays, and as whatever frames are here."""
    frames: list[Any] = [columns]
    for module, make in (("pandas", "DataFrame"), ("polars", "DataFrame"), ("pyarrow", "table")):
        try:
            frames.append(getattr(importlib.import_module(module), make)(columns))
        except ImportError:
            continue
        if module == "pandas":
            frames.append(frames[-1].convert_dtypes())
    return frames


def test_truth_values_are_no_current(arrays: dict[str, Any]) -> None:
    for frame in _frames({**arrays, "i_q_A": arrays["i_q_A"] > 0}):
        with pytest.raises(dqwatch.InputError, match=r'column "?i_q_A"? is of type bool; expected real'):
            dqwatch.fit(frame, machine=MACHINE)
        with pytest.raises(dqwatch.UsageError, match=r'column "?i_q_A"? is of type bool; expected real'):
            dqwatch.Monitor({"pole_pairs": 4}, **PLATE).block(frame)


def test_truth_values_may_be_a_status(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    for frame in _frames({**arrays, "enabled": arrays["i_q_A"] > 0}):
        assert values(dqwatch.fit(frame, machine=MACHINE)) == expected
    # Rows of a moteus that are faults.
    t_s = np.arange(100) * 1e-2
    motion = {"time": t_s, "POSITION": t_s, "VELOCITY": np.ones(100), "Q_CURRENT": np.ones(100), "TORQUE": t_s}
    for frame in _frames({**motion, "FAULT": t_s >= 0.9}):
        found = dqwatch.columns(frame)
        assert [(d.rows, d.why) for d in found.dropped] == [(10, "FAULT is not 0")]


def test_unlike_lengths(arrays: dict[str, Any]) -> None:
    with pytest.raises(dqwatch.UsageError, match="as many in all"):
        dqwatch.fit({**arrays, "i_q_A": arrays["i_q_A"][:-1]}, machine=MACHINE)


def test_a_misspelt_option_is_named(arrays: dict[str, Any]) -> None:
    # Taken for a column it would be refused as well, but not as what it is.
    with pytest.raises(dqwatch.UsageError, match=r"\(polepairs\).*an option's name"):
        dqwatch.fit(arrays, polepairs=4)


def test_time_that_goes_back(arrays: dict[str, Any]) -> None:
    t_s = arrays["t_s"].copy()
    t_s[40] = t_s[39]
    found = dqwatch.fit({**arrays, "t_s": t_s}, machine=MACHINE)
    assert any("1 row left out" in note and "its stamp is not after the row before" in note for note in found.notes)
    t_s[40] = 0.0
    with pytest.raises(dqwatch.InputError, match="time to increase") as caught:
        dqwatch.fit({**arrays, "t_s": t_s}, machine=MACHINE)
    assert caught.value.row == 40


def test_missing_column(arrays: dict[str, Any]) -> None:
    with pytest.raises(dqwatch.InputError, match="v_q_V"):
        dqwatch.fit({n: a for n, a in arrays.items() if n != "v_q_V"}, machine=MACHINE)


@pytest.mark.parametrize("source", [None, 3, object(), [], {}, {"t_s": []}, b"bytes"])
def test_no_log(source: Any) -> None:
    with pytest.raises(dqwatch.Error):
        dqwatch.fit(source)


@pytest.mark.parametrize(
    ("source", "said"), [(3, "cannot be an int;"), (object(), "cannot be an object;"), (2.5, "cannot be a float;")]
)
def test_what_is_no_log_has_its_article(source: Any, said: str) -> None:
    with pytest.raises(dqwatch.UsageError, match=said):
        dqwatch.fit(source)


def test_columns_are_mapped_with_units(arrays: dict[str, Any], expected: dict[str, Any]) -> None:
    log = {**arrays, "rpm": arrays["w_m_rad_s"] * 30 / np.pi, "mA": arrays["i_d_A"] * 1e3}
    del log["w_m_rad_s"], log["i_d_A"]
    columns = {"w_m_rad_s": {"from": "rpm", "unit": "rpm"}, "i_d_A": {"from": "mA", "unit": "mA"}}
    found = values(dqwatch.fit(log, machine={**MACHINE, "columns": columns}))
    for name in expected:
        assert found[name][0] == pytest.approx(expected[name][0], rel=1e-9)


def test_units_that_look_wrong_are_told(arrays: dict[str, Any]) -> None:
    found = dqwatch.fit({**arrays, "w_m_rad_s": arrays["w_m_rad_s"] * 30 / np.pi}, machine=MACHINE)
    assert any(note.startswith("warning: ") and "rpm" in note for note in found.notes)


def test_a_machine_file_is_read(servo_csv: Path, tmp_path: Path) -> None:
    other = tmp_path / "machine.toml"
    other.write_text("[machine]\npole_pairs = 4\nR_ohm = 0.5\n")
    assert dqwatch.fit(servo_csv).parameters["R_ohm"].nominal == 0.9
    assert dqwatch.fit(servo_csv, machine=other).parameters["R_ohm"].nominal == 0.5
    assert dqwatch.fit(servo_csv, machine={"pole_pairs": 4, "R_ohm": 0.7}).parameters["R_ohm"].nominal == 0.7


def test_memory_is_kept(arrays: dict[str, Any]) -> None:
    before = {name: array.copy() for name, array in arrays.items()}
    dqwatch.fit(arrays, machine=MACHINE)
    for name, array in arrays.items():
        assert (array == before[name]).all()


@pytest.mark.parametrize("seed", range(60))
def test_any_columns_are_a_log_or_refused(seed: int) -> None:
    rng = np.random.default_rng(seed)
    names = [*NAMES, "theta_e_rad", "v_dc_V", "torque_Nm", "", "x" * 300, "t_s ", "i_d_A\n", "ä"]
    kinds = ["f8", "f4", "f2", "i8", "u1", "?", "c8", "U3", "O", "M8[s]", ">f8", "S2", "V4"]
    rows = int(rng.integers(0, 80))
    log: dict[str, Any] = {}
    for name in rng.permutation(names)[: rng.integers(1, len(names) + 1)]:
        length = rows if rng.random() < 0.97 else int(rng.integers(0, 90))
        kind = "f8" if rng.random() < 0.8 else kinds[rng.integers(len(kinds))]
        column = rng.normal(size=length) * 10.0 ** rng.integers(-30, 30)
        if name == "t_s" and rng.random() < 0.9:
            column = np.arange(length) * 1e-4
        if rng.random() < 0.1 and length:
            column[rng.integers(length)] = rng.choice([np.nan, np.inf, -np.inf, 1e308])
        with np.errstate(all="ignore"):
            log[str(name)] = column if kind == "f8" else np.zeros(length, kind) if kind == "V4" else column.astype(kind)
    job = (dqwatch.fit, dqwatch.learn, dqwatch.monitor, dqwatch.Monitor({"pole_pairs": 4}, **PLATE).block)[seed % 4]
    try:
        job(log) if seed % 4 == 3 else job(log, pole_pairs=4)  # type: ignore[operator]
    except dqwatch.Error as error:
        assert "\n" not in str(error) and str(error)


def test_masked_values_are_missing(servo: dqwatch.SimResult) -> None:
    masked = np.ma.masked_array(servo["i_d_A"], mask=np.arange(len(servo)) == 7)
    with pytest.raises(dqwatch.InputError) as caught:
        dqwatch.fit({**servo.columns, "i_d_A": masked}, pole_pairs=4)
    assert caught.value.row == 7


def test_a_name_that_is_no_text(servo: dqwatch.SimResult) -> None:
    found = dqwatch.columns({**servo.columns, "\ud800": servo["t_s"]}, pole_pairs=4)
    assert "?" in found.unused


def test_the_link_by_name_is_a_column(servo: dqwatch.SimResult) -> None:
    link = np.linspace(300.0, 320.0, len(servo))
    found = dqwatch.columns(**{**servo.columns, "v_dc_V": link}, pole_pairs=4)
    assert found.columns["v_dc_V"].least == 300.0
