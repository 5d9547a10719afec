"""What outlives the program: one file a motor, replaced whole, with a check sum."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
from pathlib import Path
from typing import IO, Any

SCHEMA = b"dqwatch.live.state/1"


def slug(name: str) -> str:
    """A file's name, and a topic's and a path's, of any motor's name: no two are alike, and none leads anywhere."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:40]
    if name and plain == name:
        return plain
    return f"{plain}-{hashlib.sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"


def replace_file(path: Path, data: bytes) -> None:
    """Write ``path`` whole or not at all. Raises OSError."""
    fresh = path.with_name(path.name + ".new")
    try:
        with open(fresh, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(fresh, path)
    except OSError:
        fresh.unlink(missing_ok=True)
        raise


def hold(folder: Path) -> IO[str]:
    """As long as what is returned is open nobody else keeps states there. Raises ValueError where somebody does,
    OSError."""
    file = open(folder / "lock", "w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise ValueError(f"{folder}: another dqwatch live keeps its states there; expected a folder for each") from None
    return file


def write(path: Path, head: dict[str, Any], monitor: bytes) -> None:
    """Keep a motor's state. Raises OSError."""
    body = json.dumps(head, sort_keys=True).encode() + b"\n" + monitor
    replace_file(path, SCHEMA + b" " + hashlib.sha256(body).hexdigest().encode() + b"\n" + body)


def read(path: Path) -> tuple[dict[str, Any], bytes] | None:
    """What was kept; None where there is none. Raises ValueError for a foreign or damaged file, OSError."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    first, _, body = data.partition(b"\n")
    words = first.split(b" ")
    if len(words) != 2 or words[0] != SCHEMA:
        raise ValueError(f"{path}: no state of dqwatch live; remove it to begin anew")
    if hashlib.sha256(body).hexdigest().encode() != words[1]:
        raise ValueError(f"{path}: damaged; remove it to begin anew")
    head, _, monitor = body.partition(b"\n")
    found: dict[str, Any] = json.loads(head)
    return found, monitor
