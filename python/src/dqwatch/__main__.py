"""The command ``dqwatch``: what only Python has is done here, any other word goes to the compiled command."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence

#: Subcommands that are packages of dqwatch with ``main(argv) -> int``, argv without the word itself.
PACKAGES = ("fleet", "live")


def _compiled(own: str) -> str | None:
    """The first executable ``dqwatch`` on PATH that is not this script."""
    for folder in os.get_exec_path():
        path = os.path.join(folder or ".", "dqwatch")
        if not os.path.isfile(path) or not os.access(path, os.X_OK) or os.path.realpath(path) == own:
            continue
        with open(path, "rb") as file:
            # Scripts of other environments' wheels would hand it back.
            if file.read(2) != b"#!":
                return path
    return None


def main(argv: Sequence[str]) -> int:
    """Run one subcommand; ``argv`` without the program's name. Returns the exit code."""
    word = argv[0] if argv else ""
    if word in PACKAGES:
        try:
            package = importlib.import_module(f"dqwatch.{word}")
        except ModuleNotFoundError as error:
            if error.name != f"dqwatch.{word}":
                print(f"dqwatch: {word} needs {error.name}; pip install './python[{word}]'", file=sys.stderr)
                return 1
            print(f"dqwatch: this installation has no {word}", file=sys.stderr)
            return 1
        return int(package.main(list(argv[1:])))
    path = _compiled(os.path.realpath(sys.argv[0]))
    if path is None:
        print(
            f"dqwatch: {word or 'this'} is of the compiled command, which is not on PATH; `make install` puts it there",
            file=sys.stderr,
        )
        return 1
    sys.stdout.flush()
    os.execv(path, ["dqwatch", *argv])


def run() -> int:
    """The console script."""
    return main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(run())
