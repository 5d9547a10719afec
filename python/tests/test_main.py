"""The console script does what only Python has, and hands any other word to the compiled command."""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
import tomllib
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


def test_hints_name_extras_of_the_clone() -> None:
    root = Path(__file__).resolve().parents[1]
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    hints = [h for path in root.glob("src/**/*.py") for h in re.findall(r"pip install '([^']*)'", path.read_text())]
    assert len(hints) > 5
    for hint in hints:
        written = re.fullmatch(r"\./python\[(.*)\]", hint)
        assert written, hint
        assert written[1] in extras or written[1].startswith("{"), hint


@pytest.mark.parametrize(("word", "module"), [("fleet", "duckdb"), ("live", "uvicorn")])
def test_what_is_missing_is_installed_from_the_clone(tmp_path: Path, word: str, module: str) -> None:
    call = {"fleet": ["x.csv", "--out", str(tmp_path / "out")], "live": ["--demo"]}[word]
    script = (
        f"import sys; sys.modules[{module!r}] = None; from dqwatch.__main__ import main; sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run([sys.executable, "-c", script, word, *call], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert done.stderr.endswith(f"; pip install './python[{word}]'\n")


def test_packages_are_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    import types

    asked: list[list[str]] = []
    fake = types.ModuleType("dqwatch.fleet")
    fake.main = lambda argv: asked.append(argv) or 7  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "dqwatch.fleet", fake)
    assert command.main(["fleet", "scan", "x"]) == 7 and asked == [["scan", "x"]]
