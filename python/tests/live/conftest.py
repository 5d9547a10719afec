"""Logs that several tests read."""

from __future__ import annotations

from pathlib import Path

import pytest
from joints import simulate


@pytest.fixture(scope="session")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """10 s."""
    return simulate(tmp_path_factory.mktemp("healthy"), 10)


@pytest.fixture(scope="session")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """16 s; the magnets lose 6 % between 8 s and 8.1 s."""
    lost = {"value": 0.06, "t_start_s": 8, "t_end_s": 8.1}
    return simulate(tmp_path_factory.mktemp("failing"), 16, demagnetisation=lost)
