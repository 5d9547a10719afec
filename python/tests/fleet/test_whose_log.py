"""Whose log a file is, however its path was given; what beside logs is none; tables of motors that cannot be."""

import os

import pytest

from dqwatch.fleet.sources import day_of, papers_of, sources


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Two motors, two weeks, and their table."""
    for motor in ("left wheel", "right [2]"):
        (tmp_path / "logs" / motor).mkdir(parents=True)
        for day in ("2026-01-05", "2026-01-12"):
            (tmp_path / "logs" / motor / f"{day}.csv").write_text("t_s\n")
    (tmp_path / "logs" / "motors.csv").write_text("motor,type\nleft wheel,T\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "logs"


def whose(logs):
    return sorted((s.motor, s.window) for s in sources(logs))


ALL = [(m, d) for m in ("left wheel", "right [2]") for d in ("2026-01-05", "2026-01-12")]


@pytest.mark.parametrize(
    "given",
    [
        lambda t: t,
        lambda t: "logs/",
        lambda t: "logs/*/*.csv",
        lambda t: "logs/*",
        lambda t: "*/*/2026*.csv",
        lambda t: str(t / "**" / "*.csv"),
        # What a shell makes of the globs.
        lambda t: sorted(map(str, t.glob("*/*.csv"))),
        lambda t: sorted(os.path.relpath(p) for p in t.glob("*/*.csv")),
        lambda t: sorted(map(str, t.glob("*"))),
        lambda t: [t, t / "left wheel", t / "left wheel" / "2026-01-05.csv"],
    ],
)
def test_a_motor_is_the_folder_that_its_log_lies_in(tree, given):
    assert whose(given(tree)) == ALL


@pytest.mark.parametrize("given", ["logs/left wheel", "logs/left wheel/*.csv", "logs/left wheel/2026-01-05.csv"])
def test_of_one_motors_folder_too(tree, given):
    assert {m for m, _ in whose(given)} == {"left wheel"}


def test_a_name_that_looks_like_a_pattern_is_a_name(tree):
    assert whose("logs/right [2]/2026-01-05.csv") == [("right [2]", "2026-01-05")]


@pytest.mark.parametrize("given", ["logs", "logs/motor=A%2F1", "logs/motor=A%2F1/week=3", "logs/motor=A*/**/*.csv"])
def test_folders_that_say_it_say_it_from_wherever(tmp_path, monkeypatch, given):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs" / "motor=A%2F1" / "week=3").mkdir(parents=True)
    (tmp_path / "logs" / "motor=A%2F1" / "week=3" / "part-0.csv").write_text("t_s\n")
    assert whose(given) == [("A/1", "3")]


def test_names_in_one_folder_with_and_without_dates(tmp_path):
    names = ("pump1_2026-01-05.csv", "pump1_2026-01-12.csv", "pump2 20260105T1312.csv.gz", "fan.csv", "x20269905.csv")
    for name in names:
        (tmp_path / name).write_text("t_s\n")
    assert whose(tmp_path) == [
        ("fan", "fan"),
        ("pump1", "pump1_2026-01-05"),
        ("pump1", "pump1_2026-01-12"),
        ("pump2", "pump2 20260105T1312"),
        ("x20269905", "x20269905"),
    ]
    assert day_of("2026-01-05_13-12-30", 0) == pytest.approx(20458 + (13 * 3600 + 12 * 60 + 30) / 86400, abs=1e-9)


def test_what_a_run_wrote_is_no_log(tree):
    # Beside the logs, and into their folder itself.
    for out in (tree / "out", tree):
        for name in ("windows/a.parquet", "standing.csv", "groups.csv", "claims/a.json"):
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            (out / name).write_text("x")
        assert whose(tree) == whose("logs/**/*.*") == ALL
    (tree / "left wheel" / "standing.csv").write_text("t_s\n")
    assert len(whose(tree)) == 5


def test_links_to_folders_are_followed_once(tree):
    os.symlink(tree / "left wheel", tree / "right [2]" / "again")
    os.symlink(tree, tree / "left wheel" / "back")
    assert len({os.path.realpath(s.path) for s in sources(tree)}) == 4


def test_a_pipe_is_not_waited_for(tree):
    os.mkfifo(tree / "left wheel" / "2026-01-19.csv")
    (pipe,) = (s for s in sources(tree) if s.size < 0)
    with pytest.raises(OSError, match="no file"):
        pipe.content()
    assert not pipe.opens


@pytest.mark.parametrize(
    "given", ["logs", "logs/*/*.csv", ["logs/left wheel/2026-01-05.csv", "logs/right [2]/2026-01-05.csv"]]
)
def test_the_table_of_motors_is_found_from_wherever(tree, given):
    assert papers_of(given, None) == {"left wheel": {"type": "T"}}


@pytest.mark.parametrize(
    "text, says",
    [
        ("motor,pole_pairs\nA,four\n", r"motors.csv:2: pole_pairs 'four': expected a whole number"),
        ("motor,pole_pairs\nA,4\nB,2.5\n", r"motors.csv:3: pole_pairs '2.5'"),
        ("motor,pole_pairs\nA,nan\n", r"motors.csv:2: pole_pairs 'nan'"),
        ("motor,gear\nA,-3\n", r"motors.csv:2: gear '-3': expected a number above 0"),
        ("name,type\nA,x\n", r"motors.csv:2: no motor"),
        (b"motor,type\nA,\xe9\n", r"motors.csv: no table of motors"),
        (b"PAR1 not", r"motors.parquet: no table of motors"),
    ],
)
def test_a_table_of_motors_that_cannot_be_says_where(tmp_path, text, says):
    name = "motors.parquet" if text == b"PAR1 not" else "motors.csv"
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=says):
        papers_of(tmp_path, None)


def test_numbers_in_the_table_may_be_written_as_a_database_does(tmp_path):
    (tmp_path / "motors.csv").write_text("motor,pole_pairs,gear\nA,4.0,1e1\n")
    assert papers_of(tmp_path, None) == {"A": {"pole_pairs": "4.0", "gear": "1e1"}}
