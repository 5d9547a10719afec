"""Bytes of a source to rows: text lines of CSV, SimpleFOC's monitor(), JSON objects. Broken ones are counted."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from dqwatch import _core

#: What a motor takes of a row, SI.
COLUMNS = (
    "t_s",
    "v_d_V",
    "v_q_V",
    "i_d_A",
    "i_q_A",
    "w_m_rad_s",
    "theta_e_rad",
    "temp_winding_C",
    "temp_magnet_C",
)
#: Without these a row is none.
NEEDED = ("v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s")
#: A longer line is no line of a motor.
LONGEST_LINE = 65536
#: No sensor gives more; single precision and its squares take it. Seconds since 1970 are more.
LARGEST, LARGEST_T_S = 1e9, 1e11
#: Of a field before its scale: beyond lie integers that are no double.
LARGEST_RAW = 1e18

Row = dict[str, float]
#: A row each, a column each of :data:`COLUMNS`; NaN: it does not say.
Rows = npt.NDArray[np.float64]


@dataclass
class Rule:
    """One column out of a message's field: value · scale + offset."""

    field: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass
class Counts:
    """What was dropped of a source, by the reason."""

    broken: int = 0
    too_long: int = 0
    unknown_motor: int = 0
    first: str = ""

    def note(self, what: str) -> None:
        """Keep the first of them, for people."""
        if not self.first:
            self.first = what[:200]


@dataclass
class Format:
    """How a source's messages are read.

    ``kind``: csv, json. ``names``: of the fields where a text has no header. ``rules``: by column; a column without one
    is the field of its own name. ``motor_key``: the JSON field that names the motor.
    """

    kind: str
    names: tuple[str, ...] = ()
    rules: dict[str, Rule] = field(default_factory=dict)
    motor_key: str = "motor"


def format_of(name: str, pole_pairs: int, columns: Mapping[str, object]) -> Format:
    """The format of that name, with a configuration's ``columns`` over it."""
    turn = 2.0 * math.pi
    if name == "simplefoc":
        made = Format("csv", ("target", "v_q_V", "v_d_V", "i_q_mA", "i_d_mA", "w_m_rad_s", "theta_m_rad"))
        made.rules = {
            "i_q_A": Rule("i_q_mA", 1e-3),
            "i_d_A": Rule("i_d_mA", 1e-3),
            "theta_e_rad": Rule("theta_m_rad", float(pole_pairs)),
        }
    elif name == "mesc":
        made = Format("json")
        made.rules = {
            "v_d_V": Rule("Vd"),
            "v_q_V": Rule("Vq"),
            "i_d_A": Rule("id"),
            "i_q_A": Rule("iq"),
            "w_m_rad_s": Rule("ehz", turn / pole_pairs),
            "temp_winding_C": Rule("TMOT", 1.0, -273.15),
        }
    elif name in ("csv", "json"):
        made = Format(name)
    else:
        raise ValueError(f"format {name!r}; expected csv, json, simplefoc or mesc")
    for column, rule in columns.items():
        if column not in COLUMNS:
            raise ValueError(f"column {column!r}; expected one of {', '.join(COLUMNS)}")
        made.rules[column] = _rule(column, rule)
    return made


def _rule(column: str, rule: object) -> Rule:
    if isinstance(rule, str):
        return Rule(rule)
    if isinstance(rule, Mapping) and isinstance(rule.get("from"), str) and set(rule) <= {"from", "scale", "offset"}:
        return Rule(str(rule["from"]), float(rule.get("scale", 1.0)), float(rule.get("offset", 0.0)))
    raise ValueError(f'column {column}: {rule!r}; expected a name, or {{ from = "name", scale = 1.0, offset = 0.0 }}')


Plan = tuple[tuple[str, str, float, float, float, bool], ...]


def plan_of(form: Format) -> Plan:
    """Column, field, scale, offset, what it is less than, needed: of every column."""
    rules = [(c, form.rules.get(c, Rule(c))) for c in COLUMNS]
    most = {"t_s": LARGEST_T_S}
    return tuple((c, r.field, r.scale, r.offset, most.get(c, LARGEST), c in NEEDED) for c, r in rules)


def row_of(values: Mapping[str, object], plan: Plan) -> Row | None:
    """The row that a message's numbers make; None where they make none."""
    row: Row = {}
    for column, name, scale, offset, most, needed in plan:
        value = values.get(name)
        if type(value) is float or type(value) is int:
            # Of what is not a number neither is true.
            if not -LARGEST_RAW < value < LARGEST_RAW:
                return None
            row[column] = value * scale + offset
            if not -most < row[column] < most:
                return None
        elif needed or value is not None:
            return None
    return row


def rows_of(parts: Sequence[Row | Rows]) -> Rows:
    """Rows that came one at a time or many, as one array."""
    made: list[Rows] = []
    for single, some in itertools.groupby(parts, lambda part: isinstance(part, dict)):
        if single:
            made.append(np.array([[row.get(c, math.nan) for c in COLUMNS] for row in some]))  # type: ignore[union-attr]
        else:
            made.extend(some)  # type: ignore[arg-type]
    return made[0] if len(made) == 1 else np.concatenate(made)


class Decoder:
    """The messages of one stream, in pieces as they come. ``motor``: whose rows they are; empty: each says it."""

    def __init__(self, form: Format, motor: str = "") -> None:
        self.form = form
        self.motor = motor
        self.plan = plan_of(form)
        self.counts = Counts()
        self._rest = b""
        self._skipping = False
        self._names: Sequence[str] = form.names
        self._taken: list[tuple[str, int, float, float, float]] | None = None
        columns = [p[1:] for p in self.plan]
        self._json_rows = _core.JsonRows(columns, form.motor_key, motor, LARGEST_RAW)

    def lines(self, data: bytes) -> Iterator[tuple[str, Row | Rows]]:
        """Rows of whole lines. Of JSON many at once; a line that is not simple, and any other text, alone."""
        at = 0
        while at < len(data):
            if self.form.kind == "json":
                at = self._json_rows.take(data, at)
                for name, rows in self._json_rows.give():
                    yield name, np.frombuffer(rows).reshape(-1, len(COLUMNS))
            end = data.find(b"\n", at)
            line = data[at : end if end >= 0 else len(data)]
            at += len(line) + 1
            yield from self._line(line)

    def feed(self, data: bytes) -> Iterator[tuple[str, Row]]:
        """Rows of the lines that ``data`` ends; what it leaves open waits for more."""
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        if len(self._rest) > LONGEST_LINE:
            # An endless message is dropped while it lasts.
            self._rest = b""
            if not self._skipping:
                self.counts.too_long += 1
                self.counts.note("a line without end")
            self._skipping = True
        for line in lines:
            if self._skipping:
                self._skipping = False
                continue
            yield from self._line(line)

    def _line(self, line: bytes) -> Iterator[tuple[str, Row]]:
        if len(line) > LONGEST_LINE:
            self.counts.too_long += 1
            self.counts.note("a line without end")
        elif line.strip():
            yield from self.message(line)

    def message(self, line: bytes) -> Iterator[tuple[str, Row]]:
        """The row of one whole message."""
        found = self._json(line) if self.form.kind == "json" else self._csv(line)
        if found is None:
            self.counts.broken += 1
            self.counts.note(line[:80].decode("ascii", "replace"))
        elif found[1]:
            yield found

    def _json(self, line: bytes) -> tuple[str, Row] | None:
        try:
            found = json.loads(line)
        except (ValueError, RecursionError):
            return None
        if not isinstance(found, dict):
            return None
        row = row_of(found, self.plan)
        name = self.motor or found.get(self.form.motor_key)
        return (name, row) if row and isinstance(name, str) else None

    def _csv(self, line: bytes) -> tuple[str, Row] | None:
        parts = line.replace(b"\t", b",").replace(b";", b",").rstrip(b",\r ").split(b",")
        try:
            numbers = list(map(float, parts))
        except ValueError:
            return self._header(parts)
        if self._taken is None or len(numbers) != len(self._names):
            if self._taken is not None or len(self._names) != len(numbers):
                return None
            self._plan()
        row: Row = {}
        for column, k, scale, offset, most in self._taken or ():
            x = numbers[k] * scale + offset
            if not abs(x) < most:
                return None
            row[column] = x
        return self.motor, row

    def _header(self, parts: list[bytes]) -> tuple[str, Row] | None:
        names = [p.decode("utf-8", "replace").strip() for p in parts]
        if self.form.names or any(needed and name not in names for _, name, *_, needed in self.plan):
            return None
        self._names = names
        self._plan()
        return self.motor, {}

    def _plan(self) -> None:
        names = list(self._names)
        self._taken = [(c, names.index(f), s, o, most) for c, f, s, o, most, _ in self.plan if f in names]

    def reset(self) -> None:
        """The stream began anew: what was left open is none of it."""
        self._rest = b""
        self._skipping = False
