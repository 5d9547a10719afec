"""The logs of a fleet: files under a folder or a glob, whose motor and window each is, and what its papers say."""

from __future__ import annotations

import csv
import dataclasses
import glob
import hashlib
import os
import re
from collections.abc import Iterable, Mapping, Sequence

PARQUET = (".parquet", ".pq")
PAGES = "its pages cannot be read to the end"
# What lies beside logs and is none.
_BESIDE = (".toml", ".json", ".html", ".md", ".txt.license", ".part", ".lock")
PAPERS = ("type", "pole_pairs", "gear", "batch", "axis", "site", "firmware")


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
        """What key=value folders say."""
        return dict((m[1], m[2]) for m in re.finditer(r"([A-Za-z_]\w*)=([^/]+)(?=/)", self.name))

    @property
    def motor(self) -> str:
        """Of a file that names none: its folder motor=…, else the folder that it lies in, else its own name."""
        folder = os.path.dirname(self.name)
        return self.parts.get("motor") or (os.path.basename(folder) if folder and "=" not in folder else self.stem)

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
        return name[: name.index(".")] if "." in name.lstrip(".") else name

    def content(self) -> str:
        """A hash of its bytes."""
        with open(self.path, "rb") as file:
            return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()


def _files(given: str) -> Iterable[tuple[str, str]]:
    if os.path.isdir(given):
        for folder, below, names in os.walk(given):
            below.sort()
            below[:] = [b for b in below if not b.startswith((".", "_"))]
            for name in sorted(names):
                path = os.path.join(folder, name)
                yield path, os.path.relpath(path, given)
        return
    found = sorted(glob.glob(given, recursive=True)) if glob.has_magic(given) else [given]
    if found == [given] and not os.path.lexists(given):
        return
    root = given.split("*")[0].split("?")[0].split("[")[0].rpartition("/")[0] if glob.has_magic(given) else ""
    for path in found:
        yield path, os.path.relpath(path, root) if root else os.path.basename(path)


def sources(logs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]]) -> list[Source]:
    """Every log under folders, globs or paths, in order. A link to nothing is kept: its row says why.

    Errors: FileNotFoundError where nothing matches.
    """
    given = [logs] if isinstance(logs, str | os.PathLike) else list(logs)
    out: list[Source] = []
    for one in given:
        for path, name in _files(os.fspath(one)):
            base = os.path.basename(name)
            if base.startswith((".", "_", "motors.")) or base.endswith(_BESIDE) or os.path.isdir(path):
                continue
            try:
                stat = os.stat(path)
                out.append(Source(path, name, stat.st_size, stat.st_mtime_ns))
            except OSError:
                out.append(Source(path, name, -1, 0))
    if not out:
        raise FileNotFoundError(f"{', '.join(map(str, given))}: no logs; expected Parquet or other logs under it")
    return sorted(set(out))


def unreadable(source: Source) -> str:
    """Why a Parquet file's footer cannot be read; "" where it can."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        pq.read_schema(source.path)
    except (OSError, pa.ArrowException) as error:
        return next((line for line in str(error).splitlines() if line.strip()), type(error).__name__)
    return ""


def papers_of(
    logs: str | os.PathLike[str] | Sequence[str | os.PathLike[str]], motors: str | os.PathLike[str] | None
) -> dict[str, dict[str, str]]:
    """What is known of each motor without its log: the rows of motors.csv or motors.parquet, by motor.

    Errors: ValueError, with file and line, where the table has no column `motor` or names one twice.
    """
    path = os.fspath(motors) if motors is not None else ""
    if not path:
        for one in [logs] if isinstance(logs, str | os.PathLike) else list(logs):
            for name in ("motors.csv", "motors.parquet"):
                if os.path.isfile(os.path.join(os.fspath(one), name)):
                    path = os.path.join(os.fspath(one), name)
    if not path:
        return {}
    rows: list[Mapping[str, object]]
    if path.endswith(PARQUET):
        import pyarrow.parquet as pq

        rows = pq.read_table(path).to_pylist()
    else:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    out: dict[str, dict[str, str]] = {}
    for line, row in enumerate(rows, 2):
        motor = row.get("motor")
        if motor in (None, ""):
            raise ValueError(f"{path}:{line}: no motor; expected a column 'motor' with a name in every row")
        if str(motor) in out:
            raise ValueError(f"{path}:{line}: motor {motor} a second time; expected one row each")
        out[str(motor)] = {k: str(row[k]) for k in PAPERS if row.get(k) not in (None, "")}
    return out


def day_of(window: str, mtime_ns: int) -> float:
    """Days since 1970 of a window whose name has a date (2026-01-05, 20260105), or of the file."""
    import datetime

    if found := re.search(r"(?<!\d)(20\d\d)[-_]?(\d\d)[-_]?(\d\d)(?:[T_ -]?(\d\d)[-_:]?(\d\d))?", window):
        y, mo, d, h, mi = (int(x or 0) for x in found.groups())
        try:
            at = datetime.datetime(y, mo, d, h, mi, tzinfo=datetime.UTC)
            return at.timestamp() / 86400
        except ValueError:
            pass
    return mtime_ns / 86400e9
