"""Files that other libraries write are the log that was written; what is damaged is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dqwatch

NAMES = ("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s")
MACHINE = {"pole_pairs": 4, "log": {"regime": "dynamic"}}


@pytest.fixture(scope="module")
def log() -> dict[str, Any]:
    run = dqwatch.simulate(duration_s=0.1)
    return {name: np.array(run[name]) for name in NAMES}


def same(path: Path, log: dict[str, Any], part: str | None = None) -> None:
    """What is read is what was written, and the fit takes the path."""
    found = dqwatch.read(path, part)
    for name in NAMES:
        assert (np.asarray(found[name]) == log[name]).all(), name
    expected = dqwatch.fit(log, machine=MACHINE)
    assert {n: p.value for n, p in dqwatch.fit(path, machine=MACHINE).parameters.items()} == {
        n: p.value for n, p in expected.parameters.items()
    }
    # LOG.toml beside it is read.
    path.with_suffix(".toml").write_text("[log]\nregime = 'dynamic'\n[machine]\npole_pairs = 4\nR_ohm = 0.77\n")
    assert dqwatch.fit(path).parameters["R_ohm"].nominal == 0.77
    path.with_suffix(".toml").unlink()


def refuses_damage(path: Path) -> None:
    if path.is_file():
        cut = path.with_name("cut" + path.suffix)
        cut.write_bytes(path.read_bytes()[:200])
        with pytest.raises(dqwatch.InputError) as caught:
            dqwatch.fit(cut, machine=MACHINE)
        assert caught.value.file == str(cut)


def test_parquet(log: dict[str, Any], tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "log.parquet"
    parquet.write_table(pa.table({**log, "note": ["x"] * log["t_s"].size}), path)
    same(path, log)
    refuses_damage(path)


def test_mf4(log: dict[str, Any], tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    path = tmp_path / "log.mf4"
    with asammdf.MDF(version="4.10") as mdf:
        slow = asammdf.Signal(np.arange(5.0), timestamps=np.arange(5.0), name="temp_winding_C", unit="degC")
        mdf.append([slow])
        fast = [asammdf.Signal(log[name], timestamps=log["t_s"], name=name + "\\XCP:1", unit="") for name in NAMES[1:]]
        mdf.append(fast)
        mdf.save(path, overwrite=True)
    same(path, log)
    assert set(dqwatch.read(path, "group 0")) == {"temp_winding_C", "t_s"}
    with pytest.raises(dqwatch.InputError, match="group 1"):
        dqwatch.read(path, "no such")
    refuses_damage(path)


def test_mcap_of_json(log: dict[str, Any], tmp_path: Path) -> None:
    writer_of = pytest.importorskip("mcap.writer")
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = writer_of.Writer(file)
        writer.start()
        schema = writer.register_schema("drive", "jsonschema", b"{}")
        drive = writer.register_channel("/drive", "json", schema)
        other = writer.register_channel("/other", "json", schema)
        for k in range(log["t_s"].size):
            data = json.dumps({name: float(log[name][k]) for name in NAMES}).encode()
            writer.add_message(drive, log_time=k, data=data, publish_time=k)
            writer.add_message(other, log_time=k, data=b'{"x": 1}', publish_time=k)
        writer.finish()
    same(path, log, "/drive")
    refuses_damage(path)


def _written_bag(path: Path, log: dict[str, Any], version: Any) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    text = "std_msgs/Header header\n" + "".join(f"float64 {name}\n" for name in NAMES[1:])
    store.register(typesys.get_types_from_msg(text.replace("_V", "_v").replace("_A", "_a"), "drive_msgs/msg/State"))
    state, header, stamp = (
        store.types[f"{name}"]
        for name in ("drive_msgs/msg/State", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    with rosbag2.Writer(path, **version) as writer:
        connection = writer.add_connection("/drive", "drive_msgs/msg/State", typestore=store)
        for k in range(log["t_s"].size):
            at_ns = 10**9 * 100 + round(1e9 * float(log["t_s"][k]))
            head = header(stamp=stamp(sec=at_ns // 10**9, nanosec=at_ns % 10**9), frame_id="")
            message = state(head, *(float(log[name][k]) for name in NAMES[1:]))
            writer.write(connection, at_ns, store.serialize_cdr(message, "drive_msgs/msg/State"))


def test_ros1_bag(log: dict[str, Any], tmp_path: Path) -> None:
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    kind = "drive_msgs/msg/State"
    names = [name.lower() for name in NAMES[1:]]
    store.register(
        typesys.get_types_from_msg("Header header\n" + "".join(f"float64 {n}\n" for n in names) + "bool armed\n", kind)
    )
    state, header, stamp = (store.types[n] for n in (kind, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
    path = tmp_path / "log.bag"
    with rosbag1.Writer(path) as writer:
        drive = writer.add_connection("/drive", kind, typestore=store)
        other = writer.add_connection("/other", "std_msgs/msg/Float64", typestore=store)
        for k in range(log["t_s"].size):
            at_ns = 10**9 * 100 + round(1e9 * float(log["t_s"][k]))
            head = header(seq=k, stamp=stamp(sec=at_ns // 10**9, nanosec=at_ns % 10**9), frame_id="")
            message = state(head, *(float(log[name][k]) for name in NAMES[1:]), True)
            # Recorded late and unevenly: the stamp is what counts.
            writer.write(drive, at_ns + 1000 * (k % 7), store.serialize_ros1(message, kind))
            beside = store.types["std_msgs/msg/Float64"](1.0)
            writer.write(other, at_ns, store.serialize_ros1(beside, "std_msgs/msg/Float64"))
    found = dqwatch.read(path, "/drive")
    assert set(found) == {"t_s", *names, "armed"} and set(dqwatch.read(path, "/other")) == {"data", "t_s"}
    for name in NAMES[1:]:
        assert (found[name.lower()] == log[name]).all(), name
    assert np.abs(found["t_s"] - log["t_s"]).max() < 1e-7
    columns = {name: {"from": name.lower()} for name in NAMES[1:]}
    fitted = dqwatch.fit(path, machine={**MACHINE, "columns": columns})
    assert fitted.parameters["psi_Wb"].value == pytest.approx(0.12, rel=0.01)
    refuses_damage(path)


ROS_MACHINE = {
    **MACHINE,
    "columns": {name: {"from": name.replace("_V", "_v").replace("_A", "_a")} for name in NAMES[1:5]},
}


def test_ros2_bag(log: dict[str, Any], tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    path = tmp_path / "bag"
    _written_bag(path, log, {"version": rosbag2.Writer.VERSION_LATEST})
    found = dqwatch.read(path)
    assert (found["i_q_a"] == log["i_q_A"]).all()
    assert np.abs(found["t_s"] - log["t_s"]).max() < 1e-7
    fitted = dqwatch.fit(path, machine=ROS_MACHINE)
    assert fitted.parameters["psi_Wb"].value == pytest.approx(0.12, rel=0.01)


def test_ros2_mcap(log: dict[str, Any], tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    pytest.importorskip("mcap_ros2.decoder")
    path = tmp_path / "bag"
    _written_bag(path, log, {"version": rosbag2.Writer.VERSION_LATEST, "storage_plugin": rosbag2.StoragePlugin.MCAP})
    (mcap,) = path.glob("*.mcap")
    found = dqwatch.read(mcap)
    assert (found["i_q_a"] == log["i_q_A"]).all()
    assert np.abs(found["t_s"] - log["t_s"]).max() < 1e-7


def test_hdf5(log: dict[str, Any], tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["setting"] = np.arange(7.0)
        file["run/drive/gains"] = np.arange(3.0)
        for name in NAMES:
            file[f"run/drive/{name}"] = log[name]
    same(path, log, "run/drive")
    refuses_damage(path)


@pytest.mark.parametrize("nested", [False, True])
def test_mat(log: dict[str, Any], tmp_path: Path, nested: bool) -> None:
    io = pytest.importorskip("scipy.io")
    path = tmp_path / "log.mat"
    io.savemat(path, {"run": log} if nested else {**log, "gain": 3.0})
    same(path, log, "run" if nested else "")
    refuses_damage(path)


def test_mat_73(log: dict[str, Any], tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in NAMES:
            # Matlab's arrays stand transposed there.
            file[name] = log[name].reshape(1, -1)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(512))
    same(path, log, "")


def test_what_is_no_container(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t_s\n")
    with pytest.raises(dqwatch.UsageError):
        dqwatch.read(path)


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    path = tmp_path / "log.mf4"
    path.write_bytes(b"MDF     " + bytes(200))
    monkeypatch.setitem(sys.modules, "asammdf", None)
    with pytest.raises(dqwatch.InputError) as caught:
        dqwatch.fit(path)
    assert caught.value.advice == "pip install './python[mf4]'"
