"""The console script does what only Python has, and hands any other word to the compiled command."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import dqwatch.__main__ as command


def run(path: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "dqwatch", *words],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def executable(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_none_on_path(tmp_path: Path) -> None:
    done = run(str(tmp_path), "fit", "log.csv")
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1
    assert "fit" in done.stderr and "PATH" in done.stderr


def test_other_scripts_are_passed_by(tmp_path: Path) -> None:
    script, real = tmp_path / "script", tmp_path / "real"
    script.mkdir()
    real.mkdir()
    executable(script / "dqwatch", b"#!/bin/sh\necho script\n")
    # Any compiled program that says its words.
    os.symlink("/bin/echo", real / "dqwatch")
    done = run(f"{script}:{real}", "fit", "log.csv", "--json")
    assert done.returncode == 0 and done.stdout == "fit log.csv --json\n"


def test_it_is_the_commands(have_command: bool) -> None:
    built = Path(__file__).resolve().parents[2] / "build"
    if not (built / "dqwatch").is_file():
        pytest.skip("no build/dqwatch")
    done = run(str(built), "--version")
    assert done.returncode == 0 and done.stdout.startswith("dqwatch ")


def test_packages_are_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    import types

    asked: list[list[str]] = []
    fake = types.ModuleType("dqwatch.fleet")
    fake.main = lambda argv: asked.append(argv) or 7  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "dqwatch.fleet", fake)
    assert command.main(["fleet", "scan", "x"]) == 7 and asked == [["scan", "x"]]
