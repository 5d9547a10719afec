"""README's lines of Python print what stands below them."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]


def test_readme() -> None:
    readme = REPOSITORY / "README.md"
    if not readme.is_file():
        pytest.skip("no README.md beside the tests")
    found = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", readme.read_text(), re.DOTALL)
    assert found
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(found[1], "README.md", "exec"), {})
    assert said.getvalue() == found[2]
