"""The fleet's tests need its extra; without, they are skipped by name. One small fleet serves many of them."""

import dataclasses
import importlib.util
import pathlib

import pytest

MISSING = [m for m in ("scipy", "duckdb", "pyarrow") if importlib.util.find_spec(m) is None]


def pytest_ignore_collect(collection_path, config):
    """Says by name what stays away, and why."""
    if not MISSING or not collection_path.name.startswith("test_"):
        return None
    if reporter := config.pluginmanager.get_plugin("terminalreporter"):
        reporter.write_line(
            f"skipped: fleet/{collection_path.name}, no {', '.join(MISSING)}; pip install './python[fleet]'"
        )
    return True


@dataclasses.dataclass
class Small:
    """Logs of a few motors, what a run made of them, and its folder."""

    logs: pathlib.Path
    out: pathlib.Path
    result: object


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    import dqwatch.fleet
    from dqwatch.fleet.simulated import write
    from dqwatch.fleet.simulated.planted import drawn

    root = tmp_path_factory.mktemp("fleet")
    fleet = drawn(1, motors=6, weeks=3, rows=400, each=0, batch=2)
    write.coasting, coasting = lambda fleet: [], write.coasting
    try:
        logs = write.write(fleet, root, processes=2)
    finally:
        write.coasting = coasting
    return Small(logs, root / "out", dqwatch.fleet(logs, root / "out", threads=2))
