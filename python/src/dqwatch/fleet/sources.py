"""The logs of a fleet: files under a folder or a glob, whose motor and window each is, and what its papers say."""

from __future__ import annotations

import csv
import dataclasses
import datetime
import glob
import hashlib
import os
import re
import urllib.parse
from collections.abc import Iterable, Iterator, Mapping, Sequence

PARQUET = (".parquet", ".pq")
PAGES = "its pages cannot be read to the end"
# What lies beside logs and is none.
_BESIDE = (".toml", ".json", ".html", ".md", ".pdf", ".png", ".jpg", ".txt.license", ".part", ".lock")
_TABLES = ("motors.csv", "motors.parquet")
_WRITTEN = ("windows", "claims", "fleet.html", "standing.csv", "groups.csv", "compared.parquet")
PAPERS = ("type", "pole_pairs", "gear", "batch", "axis", "site", "firmware")
_DATE = re.compile(r"(?<!\d)(20\d\d)[-_]?(\d\d)[-_]?(\d\d)(?:[T_ -]?(\d\d)[-_:]?(\d\d)(?:[-_:]?(\d\d))?)?")
_KEYED = re.compile(r"(?:motor|window|week|day|date)=.+")

Logs = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


def text_of_name(name: str) -> str:
    """A file's name as text, whatever its bytes are."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


@dataclasses.dataclass(frozen=True, order=True)
class Source:
    """One file; `name` is its path from the folder that was given."""

    path: str
    name: str
    size: int
    mtime_ns: int

    @property
    def parquet(self) -> bool:
        """By its name."""
        return self.path.endswith(PARQUET)

    @property
    def parts(self) -> dict[str, str]:
        """What key=value folders say; those that write them spell what a path may not hold as %2F."""
        found = re.finditer(r"([A-Za-z_]\w*)=([^/]+)(?=/)", self.name)
        return {m[1]: urllib.parse.unquote(m[2]) for m in found}

    @property
    def motor(self) -> str:
        """Of a file that names none: its folder motor=…, else the folder that it lies in. Of one that lies in the
        folder given itself its own name without a date, and that folder where a date is all that it is named."""
        if said := self.parts.get("motor"):
            return said
        folder = os.path.basename(os.path.dirname(self.name))
        if folder and "=" not in folder:
            return folder
        own = self.stem
        if (found := _DATE.search(own)) and _day(found) is not None:
            own = (own[: found.start()] + own[found.end() :]).strip(" _-.")
        return own or text_of_name(os.path.basename(os.path.dirname(os.path.abspath(self.path)))) or self.stem

    @property
    def window(self) -> str:
        """A folder window=…, week=…, day=… or date=…, else its own name."""
        for key in ("window", "week", "day", "date"):
            if key in self.parts:
                return self.parts[key]
        return self.stem

    @property
    def stem(self) -> str:
        """Its name without endings."""
        name = os.path.basename(self.name)
        return name[: name.index(".", 1)] if "." in name[1:] else name

    @property
    def key(self) -> tuple[str, int, int]:
        """By what a file is known again."""
        return self.name, self.size, self.mtime_ns

    @property
    def opens(self) -> bool:
        """Whether it can be opened now. A pipe would wait for its writer."""
        if self.size < 0:
            return False
        try:
            with open(self.path, "rb"):
                return True
        except OSError:
            return False

    def content(self) -> str:
        """A hash of its bytes. Errors: OSError."""
        if os.path.exists(self.path) and not os.path.isfile(self.path):
            # A pipe would wait for its writer.
            raise OSError("no file: a folder that cannot be read, or a device")
        with open(self.path, "rb") as file:
            return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()


def _above_keys(folder: str) -> str:
    """The folder above the first that says key=value: a part of a fleet has the names that it has in the whole."""
    parts = os.path.abspath(folder).split(os.sep)
    for k, part in enumerate(parts):
        if _KEYED.fullmatch(part):
            return os.sep.join(parts[:k]) or os.sep
    return folder or "."


def _walked(folder: str, root: str) -> Iterator[tuple[str, str]]:
    seen: set[str] = set()
    shut: list[str] = []
    # A link may lead to a folder of logs, and back.
    for at, below, names in os.walk(folder, followlinks=True, onerror=lambda e: shut.append(str(e.filename))):
        if (real := os.path.realpath(at)) in seen:
            below.clear()
            continue
        seen.add(real)
        below[:] = sorted(b for b in below if not b.startswith((".", "_")))
        for name in sorted(names):
            path = os.path.join(at, name)
            yield path, os.path.relpath(path, root)
    yield from ((path, os.path.relpath(path, root)) for path in shut)


def _given(logs: Logs) -> list[tuple[str, list[str]]]:
    """What stands for logs, each with the folder that its names begin from: folders, globs, and files, which a shell
    may have made of a glob, from the folder that they share."""
    given = [os.fspath(one) for one in ([logs] if isinstance(logs, str | os.PathLike) else list(logs))]
    out: list[tuple[str, list[str]]] = []
    single: list[str] = []
    for one in given:
        if os.path.isdir(one):
            out.append((_above_keys(one), [one]))
        elif glob.has_magic(one) and not os.path.lexists(one):
            steady = one[: re.search(r"[*?\[]", one).start()]  # type: ignore[union-attr]
            out.append((_above_keys(os.path.dirname(steady)), sorted(glob.glob(one, recursive=True))))
        elif os.path.lexists(one):
            single.append(one)
    if single:
        shared = os.path.commonpath([os.path.dirname(os.path.abspath(one)) for one in single])
        out.append((_above_keys(shared), single))
    return out


def _files(logs: Logs) -> Iterable[tuple[str, str]]:
    for root, paths in _given(logs):
        for path in paths:
            if os.path.isdir(path):
                yield from _walked(path, root)
            else:
                yield path, os.path.relpath(path, root)


def _written(path: str, known: dict[str, bool]) -> bool:
    """Whether a run wrote it, into what is the folder of its results by having both windows/ and claims/."""

    def results(folder: str) -> bool:
        if folder not in known:
            known[folder] = all(os.path.isdir(os.path.join(folder, own)) for own in ("windows", "claims"))
        return known[folder]

    folder, base = os.path.split(path)
    above, inside = os.path.split(folder)
    return (base in _WRITTEN and results(folder)) or (inside in _WRITTEN and results(above))


def sources(logs: Logs) -> list[Source]:
    """Every log under folders, globs or paths, each once, in order; nothing that a run wrote. A link to nothing is
    kept: its row says why.

    Errors: FileNotFoundError where nothing matches.
    """
    found: dict[str, Source] = {}
    results: dict[str, bool] = {}
    for path, name in _files(logs):
        whole = os.path.abspath(path)
        base = os.path.basename(name)
        if whole in found or _written(whole, results):
            continue
        if base.startswith((".", "_")) or base in _TABLES or base.endswith(_BESIDE):
            continue
        try:
            stat = os.stat(path)
            size, mtime_ns = (stat.st_size, stat.st_mtime_ns) if os.path.isfile(path) else (-1, 0)
        except OSError:
            size, mtime_ns = -1, 0
        found[whole] = Source(path, text_of_name(name), size, mtime_ns)
    if not found:
        given = [logs] if isinstance(logs, str | os.PathLike) else list(logs)
        raise FileNotFoundError(f"{', '.join(map(str, given))}: no logs; expected Parquet or other logs under it")
    return sorted(found.values())


def _table_beside(logs: Logs) -> str:
    """motors.csv or motors.parquet where names of logs begin, or in the folder given; "" for none."""
    for root, paths in _given(logs):
        for folder in (*filter(os.path.isdir, paths), root):
            for name in _TABLES:
                if os.path.isfile(path := os.path.join(folder, name)):
                    return path
    return ""


def _checked(path: str, line: int, said: dict[str, str]) -> dict[str, str]:
    """Errors: ValueError where what is a number is none."""
    for key, least in (("pole_pairs", 1.0), ("gear", 1e-9)):
        if key not in said:
            continue
        try:
            x = float(said[key])
        except ValueError:
            x = float("nan")
        if not least <= x < 1e6 or (key == "pole_pairs" and x != int(x)):
            what = "a whole number from 1 on" if key == "pole_pairs" else "a number above 0"
            raise ValueError(f"{path}:{line}: {key} {said[key]!r}: expected {what}")
    return said


def papers_of(logs: Logs, motors: str | os.PathLike[str] | None) -> dict[str, dict[str, str]]:
    """What is known of each motor without its log: the rows of motors.csv or motors.parquet, by motor.

    Errors: ValueError, with file and line, where the table has no column `motor`, names one twice, or has no number
    where one belongs.
    """
    path = os.fspath(motors) if motors is not None else _table_beside(logs)
    if not path:
        return {}
    rows: list[Mapping[str, object]]
    try:
        if path.endswith(PARQUET):
            import pyarrow.parquet as pq

            rows = pq.ParquetFile(path).read().to_pylist()
        else:
            with open(path, newline="", encoding="utf-8-sig") as file:
                rows = list(csv.DictReader(file))
    except (ValueError, csv.Error) as error:
        raise ValueError(f"{path}: no table of motors: {error}") from error
    out: dict[str, dict[str, str]] = {}
    for line, row in enumerate(rows, 2):
        motor = row.get("motor")
        if motor in (None, ""):
            raise ValueError(f"{path}:{line}: no motor; expected a column 'motor' with a name in every row")
        if str(motor) in out:
            raise ValueError(f"{path}:{line}: motor {motor} a second time; expected one row each")
        out[str(motor)] = _checked(path, line, {k: str(row[k]) for k in PAPERS if row.get(k) not in (None, "")})
    return out


def _day(found: re.Match[str]) -> float | None:
    try:
        at = datetime.datetime(*(int(x or 0) for x in found.groups()), tzinfo=datetime.UTC)  # type: ignore[misc,arg-type]
    except ValueError:
        return None
    return at.timestamp() / 86400


def day_of(window: str, mtime_ns: int) -> float:
    """Days since 1970 of a window whose name has a date (2026-01-05, 20260105), or of the file."""
    found = _DATE.search(window)
    day = _day(found) if found else None
    return mtime_ns / 86400e9 if day is None else day
