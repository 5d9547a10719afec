"""Logs that several tests read, and the compiled command, which judges."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import dqwatch

REPOSITORY = Path(__file__).resolve().parents[2]


def _command() -> str | None:
    given = os.environ.get("DQWATCH_COMMAND")
    built = REPOSITORY / "build" / "dqwatch"
    return given or (str(built) if built.is_file() else None)


@pytest.fixture(scope="session")
def command() -> Callable[..., str]:
    """Runs the compiled command and gives what it prints; skips without it."""
    path = _command()
    if path is None:
        pytest.skip("no build/dqwatch, and no DQWATCH_COMMAND")

    def run(*arguments: str) -> str:
        done = subprocess.run([path, *arguments], capture_output=True, text=True, check=False)
        assert done.returncode in (0, 4), done.stderr
        return done.stdout

    return run


def _write(result: dqwatch.SimResult, folder: Path, name: str) -> Path:
    columns = result.columns
    path = folder / f"{name}.csv"
    with path.open("w") as file:
        file.write(",".join(columns) + "\n")
        for row in zip(*(c.tolist() for c in columns.values()), strict=True):
            file.write(",".join(map(repr, row)) + "\n")
    machine = "\n".join(f"{key} = {value}" for key, value in result.truth.items())
    path.with_suffix(".toml").write_text(f'[log]\nregime = "{result.regime}"\n[machine]\n{machine}\n')
    return path


@pytest.fixture(scope="session")
def servo() -> dqwatch.SimResult:
    """Half a second of a servo."""
    return dqwatch.simulate(scenario="servo", duration_s=0.5)


@pytest.fixture(scope="session")
def servo_csv(servo: dqwatch.SimResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as a file, every digit of it, and its machine file."""
    return _write(servo, tmp_path_factory.mktemp("servo"), "servo")


@pytest.fixture(scope="session")
def weak() -> dqwatch.SimResult:
    """A servo whose magnet loses a tenth of its flux."""
    return dqwatch.simulate(scenario="fault_demagnetisation")


@pytest.fixture(scope="session")
def weak_csv(weak: dqwatch.SimResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as a file."""
    return _write(weak, tmp_path_factory.mktemp("weak"), "weak")


@pytest.fixture(scope="session")
def have_command() -> bool:
    """Is there a compiled command anywhere?"""
    return _command() is not None or shutil.which("dqwatch") is not None
