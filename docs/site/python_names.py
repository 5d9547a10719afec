#!/usr/bin/env python3
"""Public names of the Python package that have no docstring of their own, or no place in the reference, a line each; none,
and it succeeds."""

import inspect
import pathlib
import re
import sys

import dqwatch


PAGE = pathlib.Path(__file__).parent / "pages/python.md"


def unlisted() -> list[str]:
    """Names that dqwatch offers and the reference does not have."""
    listed = set(re.findall(r"^::: dqwatch\.(\w+)$", PAGE.read_text(), re.M))
    return [name for name in dqwatch.__all__ if name not in listed and not name.startswith("_")]


def missing() -> list[str]:
    """Functions and classes that dqwatch offers, and their public methods and properties."""
    found = []
    for name in dqwatch.__all__:
        thing = getattr(dqwatch, name)
        if not (inspect.isclass(thing) or inspect.isfunction(thing)):
            continue
        if not (thing.__doc__ or "").strip() or (thing.__doc__ or "").startswith(f"{name}("):
            found.append(f"dqwatch.{name}")
        members = vars(thing).items() if inspect.isclass(thing) else ()
        for inner, member in members:
            public = not inner.startswith("_") and (inspect.isfunction(member) or isinstance(member, (property, classmethod)))
            if public and not (inspect.getdoc(getattr(member, "__func__", member)) or "").strip():
                found.append(f"dqwatch.{name}.{inner}")
    return found


if __name__ == "__main__":
    lines = [f"{name} has no docstring" for name in missing()]
    lines += [f"dqwatch.{name} is not in docs/site/pages/python.md" for name in unlisted()]
    print("".join(f"{line}\n" for line in lines), end="")
    sys.exit(1 if lines else 0)
