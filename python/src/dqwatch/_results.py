"""What the jobs give back: frozen, with units in the names, and the command's JSON."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from ._errors import UsageError

Backend = Literal["pandas", "polars"]
_Value = TypeVar("_Value")

_UNITS = {
    "ohm": "Ω",
    "H": "H",
    "Wb": "Wb",
    "kgm2": "kg m²",
    "Nms_rad": "Nm s/rad",
    "Nm_A": "Nm/A",
    "V": "V",
    "A": "A",
    "rad": "rad",
    "s": "s",
    "C": "°C",
    "K": "K",
    "Nm": "Nm",
    "rad_s": "rad/s",
    "Hz": "Hz",
    "per_K": "1/K",
    "rpm_V": "rpm/V",
}


def unit_of(name: str) -> str:
    """The unit that a name's suffix says, e.g. "Wb" of ``psi_Wb``; empty where it has none."""
    for suffix in sorted(_UNITS, key=len, reverse=True):
        if name.endswith("_" + suffix):
            return _UNITS[suffix]
    return ""


class Frozen(Mapping[str, _Value]):
    """A mapping that is not written. It is pickled, as types.MappingProxyType is not."""

    def __init__(self, of: Mapping[str, _Value]) -> None:
        self._of = dict(of)

    def __getitem__(self, name: str) -> _Value:
        return self._of[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._of)

    def __len__(self) -> int:
        return len(self._of)

    def __repr__(self) -> str:
        return repr(self._of)


def frame_of(columns: Mapping[str, Any], backend: Backend) -> Any:
    """Columns as a frame of pandas or polars."""
    if backend == "pandas":
        import pandas

        return pandas.DataFrame(dict(columns))
    if backend == "polars":
        import polars

        return polars.DataFrame(dict(columns))
    raise UsageError(f"no frames of {backend!r}; expected 'pandas' or 'polars'")


def table_html(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table for a notebook, every cell escaped."""

    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return f"<table>{line(head, 'th')}{''.join(line(row, 'td') for row in rows)}</table>"


def _axes() -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise UsageError("no matplotlib for plot(); pip install './python[plot]'") from None
    return plt.subplots()[1]


@dataclass(frozen=True)
class Parameter:
    """One parameter of the machine or of an effect.

    ``name`` carries the unit (``psi_Wb``), ``unit`` is its symbol. ``value`` and ``sd`` (one standard deviation) are in
    that unit; ``sd`` is None where the value was given. ``usable`` is False where ``value`` must not be relied on, and
    ``why`` says why. ``nominal`` is what the machine file says.
    """

    name: str
    value: float
    sd: float | None
    unit: str = ""
    usable: bool = True
    why: str = ""
    given: bool = False
    nominal: float | None = None

    def __format__(self, spec: str) -> str:
        return str(self) if not spec else format(self.value, spec)

    def __str__(self) -> str:
        sd = "" if self.sd is None else f" ± {self.sd:.2g}"
        return f"{self.value:.6g}{sd} {self.unit}".rstrip()

    def _repr_html_(self) -> str:
        return html.escape(f"{self.name} {self}" + (f" (not usable: {self.why})" if self.why else ""))


@dataclass(frozen=True)
class NotIdentifiable:
    """A parameter that the log cannot determine: why, and which excitation would help."""

    name: str
    why: str
    excitation: str


@dataclass(frozen=True)
class Effect:
    """An effect of the machine or the drive: its parameters by name, and how sure the name is (0 to 1, or None)."""

    name: str
    parameters: Mapping[str, Parameter]
    confidence: float | None = None
    confusable_with: tuple[str, ...] = ()
    separate: str = ""


def parameters_of(found: Mapping[str, Any]) -> Mapping[str, Parameter]:
    """The parameters of a JSON object, in its order."""
    return Frozen(
        {
            name: Parameter(
                name=name,
                value=entry["value"],
                sd=entry.get("sd"),
                unit=unit_of(name),
                usable=entry.get("usable", True),
                why=entry.get("why", ""),
                given=entry.get("given", False),
                nominal=entry.get("nominal"),
            )
            for name, entry in found.items()
        }
    )


def _effects_of(found: Sequence[Mapping[str, Any]]) -> tuple[Effect, ...]:
    return tuple(
        Effect(
            name=e["name"],
            parameters=parameters_of(e["parameters"]),
            confidence=e.get("confidence"),
            confusable_with=tuple(e.get("confusable_with", ())),
            separate=e.get("separate", ""),
        )
        for e in found
    )


_PARAMETER_HEAD = ("parameter", "value", "sd", "unit", "usable", "why")


def _parameter_rows(parameters: Mapping[str, Parameter]) -> list[tuple[str, ...]]:
    return [
        (
            p.name,
            f"{p.value:.6g}",
            "given" if p.sd is None else f"{p.sd:.2g}",
            p.unit,
            "yes" if p.usable else "no",
            p.why,
        )
        for p in parameters.values()
    ]


def _parameter_columns(parameters: Mapping[str, Parameter]) -> dict[str, list[Any]]:
    return {
        "parameter": [p.name for p in parameters.values()],
        "value": [float(p.value) for p in parameters.values()],
        "sd": [float("nan") if p.sd is None else float(p.sd) for p in parameters.values()],
        "unit": [p.unit for p in parameters.values()],
        "usable": [p.usable for p in parameters.values()],
        "why": [p.why for p in parameters.values()],
    }


def _plot_parameters(axes: Any, parameters: Mapping[str, Parameter]) -> Any:
    """Deviations in percent of the values: what is known, and how well."""
    axes = _axes() if axes is None else axes
    known = [p for p in parameters.values() if p.sd is not None and p.value]
    axes.barh(
        [p.name for p in known],
        [100.0 * (p.sd or 0.0) / abs(p.value) for p in known],
        color=["tab:blue" if p.usable else "tab:red" for p in known],
    )
    axes.set_xlabel("standard deviation, % of the value")
    axes.invert_yaxis()
    return axes


@dataclass(frozen=True)
class Result:
    """What all results have: the command's JSON and text of the same job, and its notes."""

    _json: str = field(repr=False)
    text: str = field(repr=False)
    notes: tuple[str, ...] = field(repr=False)

    def to_json(self) -> str:
        """The command's JSON of the same job (``--json``), to the last digit."""
        return self._json

    def to_dict(self) -> dict[str, Any]:
        """The same as objects of Python."""
        found: dict[str, Any] = json.loads(self._json)
        return found

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class FitResult(Result):
    """Parameters of one machine with their deviations, by the reference fit or by the learners of firmware.

    Attributes
    ----------
    parameters : mapping of name to Parameter
        e.g. ``result.parameters["psi_Wb"].value``; names carry their units
    verdict : str
        "usable" where all that was asked for is, "partly_usable", "not_usable" where nothing is
    not_identifiable : tuple of NotIdentifiable
    effects : tuple of Effect
    regime : str
        dynamic, steady, standstill, mechanical or polled
    rows_used : int
    residual_rms : float
        what the model leaves, in ``residual_unit``
    residual_percent : mapping of axis to float
        the same of the RMS of that axis' voltage (torque)
    """

    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    verdict: str = ""
    not_identifiable: tuple[NotIdentifiable, ...] = ()
    effects: tuple[Effect, ...] = ()
    regime: str = ""
    rows_used: int = 0
    residual_rms: float = float("nan")
    residual_unit: str = ""
    residual_percent: Mapping[str, float] = field(default_factory=dict)
    q15_config: str = field(default="", repr=False)

    def to_frame(self, backend: Backend = "pandas") -> Any:
        """One row a parameter: parameter, value, sd, unit, usable, why."""
        return frame_of(_parameter_columns(self.parameters), backend)

    def plot(self, axes: Any = None) -> Any:
        """Each parameter's deviation in percent, on matplotlib's ``axes`` or new ones; returns them."""
        return _plot_parameters(axes, self.parameters)

    def _repr_html_(self) -> str:
        lost = "".join(
            f"<p>{html.escape(n.name)} cannot be told: {html.escape(n.why)}. {html.escape(n.excitation)}</p>"
            for n in self.not_identifiable
        )
        doubtful = ", ".join(p.name for p in self.parameters.values() if not p.usable)
        told = f"{self.rows_used} rows; " + (f"not usable: {doubtful}; " if doubtful else "")
        percent = ", ".join(f"{axis} {value:.3g} %" for axis, value in self.residual_percent.items())
        return (
            f"<p><b>{html.escape(self.verdict.replace('_', ' '))}</b>: {html.escape(self.regime)},"
            f" {html.escape(told)}residual {self.residual_rms:.3g} {html.escape(self.residual_unit)}"
            f" ({html.escape(percent)})</p>{table_html(_PARAMETER_HEAD, _parameter_rows(self.parameters))}{lost}"
        )


def _verdict_of(parameters: Mapping[str, Parameter], lost: Sequence[NotIdentifiable]) -> str:
    estimated = [p for p in parameters.values() if not p.given]
    usable = sum(p.usable for p in estimated)
    if usable and usable == len(estimated) and not lost:
        return "usable"
    return "partly_usable" if usable else "not_usable"


def fit_result(done: Mapping[str, Any]) -> FitResult:
    """A FitResult of what the compiled part gives."""
    found = json.loads(done["json"])
    parameters = parameters_of(found["parameters"])
    lost = tuple(
        NotIdentifiable(n["name"], n.get("why", ""), n.get("excitation", "")) for n in found["not_identifiable"]
    )
    return FitResult(
        _json=done["json"],
        text=done["text"],
        notes=tuple(done["notes"]),
        parameters=parameters,
        verdict=_verdict_of(parameters, lost),
        not_identifiable=lost,
        effects=_effects_of(found["effects"]),
        regime=found["regime"],
        rows_used=found["rows"],
        residual_rms=_number(found["residual"]["rms"]),
        residual_unit=found["residual"]["unit"],
        residual_percent=Frozen({a["axis"]: _number(a["percent"]) for a in found["residual"]["axes"]}),
        q15_config=done.get("q15_config", ""),
    )


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


@dataclass(frozen=True)
class PagedResult(Result):
    """A result that has a page as well."""

    page: str = field(default="", repr=False)
    first: str = field(default="", repr=False)

    def to_html(self) -> str:
        """The command's page: one file that opens offline."""
        return self.page

    def _repr_html_(self) -> str:
        """The page's first screen, in a frame of its height at any width: its style is not the notebook's."""
        return (
            f'<iframe srcdoc="{html.escape(self.first)}" style="width:100%;height:600px;border:0"'
            ' onload="const b=this.contentDocument.body;'
            "new ResizeObserver(()=>this.style.height=b.offsetHeight+'px').observe(b)\"></iframe>"
        )


@dataclass(frozen=True)
class TraceResult(PagedResult):
    """Which physical effect the model of a log lacks.

    Attributes
    ----------
    verdict : str
        clean, explained, partly_explained or unexplained
    sentence : str
        what came of it
    effects : tuple of Effect
        those found, with confidence, and the names they could be taken for
    before, after : mapping of name to Parameter
        the machine's parameters without and with the effects
    residual_before, residual_after, noise_floor : float
        RMS of what is left on rows that no fit saw, in ``unit``
    """

    verdict: str = ""
    sentence: str = ""
    effects: tuple[Effect, ...] = ()
    before: Mapping[str, Parameter] = field(default_factory=dict)
    after: Mapping[str, Parameter] = field(default_factory=dict)
    residual_before: float = float("nan")
    residual_after: float = float("nan")
    noise_floor: float = float("nan")
    unit: str = ""
    regime: str = ""
    rows_used: int = 0
    advice: tuple[str, ...] = ()

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The machine's parameters with the effects in the model."""
        return self.after

    def to_frame(self, backend: Backend = "pandas") -> Any:
        """One row a parameter of each effect: effect, parameter, value, sd, unit, confidence."""
        rows = [(e, p) for e in self.effects for p in e.parameters.values()]
        return frame_of(
            {
                "effect": [e.name for e, _ in rows],
                "parameter": [p.name for _, p in rows],
                "value": [float(p.value) for _, p in rows],
                "sd": [float("nan") if p.sd is None else float(p.sd) for _, p in rows],
                "unit": [p.unit for _, p in rows],
                "confidence": [_number(e.confidence) for e, _ in rows],
            },
            backend,
        )

    def plot(self, axes: Any = None) -> Any:
        """The residual on unseen rows before and after, beside the noise floor."""
        axes = _axes() if axes is None else axes
        axes.bar(["before", "after"], [self.residual_before, self.residual_after])
        axes.axhline(self.noise_floor, color="black", linestyle="--", label="noise floor")
        axes.set_ylabel(f"residual on unseen rows, {self.unit}")
        axes.legend()
        return axes


def trace_result(done: Mapping[str, Any]) -> TraceResult:
    """A TraceResult of what the compiled part gives."""
    found = json.loads(done["json"])
    return TraceResult(
        _json=done["json"],
        text=done["text"],
        notes=tuple(done["notes"]),
        page=done["page"],
        first=done["first"],
        verdict=found["verdict"],
        sentence=found["sentence"],
        effects=_effects_of(found["effects"]),
        before=parameters_of(found["before"]["parameters"]),
        after=parameters_of(found["after"]["parameters"]),
        residual_before=_number(found["before"]["heldout_rms"]),
        residual_after=_number(found["after"]["heldout_rms"]),
        noise_floor=_number(found["noise_floor"]),
        unit=found["unit"],
        regime=found["regime"],
        rows_used=found["rows"],
        advice=tuple(found["advice"]),
    )


@dataclass(frozen=True)
class CompareResult(PagedResult):
    """Float learners, fixed-point learners and the reference fit on one log; ``to_dict()`` has all three."""

    def to_frame(self, backend: Backend = "pandas") -> Any:
        """One row a parameter: what each of the three makes of it."""
        found = self.to_dict()
        whose = ("float", "q15", "reference")
        names = list(dict.fromkeys(name for who in whose for name in found[who]))
        columns: dict[str, list[Any]] = {"parameter": names}
        for who in whose:
            for what in ("value", "sd"):
                columns[f"{who}_{what}"] = [_number(found[who].get(name, {}).get(what)) for name in names]
        return frame_of(columns, backend)

    def plot(self, axes: Any = None) -> Any:
        """By how much float and fixed point are apart from the reference, in percent."""
        axes = _axes() if axes is None else axes
        frame = self.to_frame()
        for who in ("float", "q15"):
            axes.plot(
                100.0 * (frame[f"{who}_value"] / frame["reference_value"] - 1.0), frame["parameter"], "o", label=who
            )
        axes.set_xlabel("from the reference fit, %")
        axes.legend()
        return axes


@dataclass(frozen=True)
class Event:
    """A change of the machine that the monitor tells.

    ``t_s`` when it was named, ``since_s`` when it began to show; ``parameter`` the channel, with its unit as suffix;
    ``value``, ``sd`` and ``healthy`` in that unit (NaN: not known); ``fault`` its name, ``confidence`` 0 to 1,
    ``phase`` "a", "b", "c" or empty.
    """

    t_s: float
    since_s: float
    parameter: str
    value: float
    sd: float
    healthy: float
    fault: str
    confidence: float
    phase: str = ""
    _json: str = field(default="", repr=False)

    def to_json(self) -> str:
        """The line that the command prints: schema dqwatch.event/1."""
        return self._json


def event_of(line: str) -> Event:
    """An event of its JSON line."""
    e = json.loads(line)
    return Event(
        t_s=_number(e["t_s"]),
        since_s=_number(e.get("since_s")),
        parameter=e["parameter"],
        value=_number(e["value"]),
        sd=_number(e["sd"]),
        healthy=_number(e.get("healthy")),
        fault=e["fault"],
        confidence=_number(e.get("confidence")),
        phase=e.get("phase", ""),
        _json=line.rstrip("\n"),
    )


@dataclass(frozen=True)
class MonitorResult(PagedResult):
    """A log under the condition monitor.

    Attributes
    ----------
    outcome : str
        one sentence
    events : tuple of Event
    sensitivity : mapping
        of each channel the smallest change that would be told, whether it is watched, and why not
    rows_used : int
    """

    outcome: str = ""
    events: tuple[Event, ...] = ()
    sensitivity: Mapping[str, Any] = field(default_factory=dict)
    rows_used: int = 0
    q15_header: str = field(default="", repr=False)

    def to_dict(self) -> dict[str, Any]:
        """{"events": …, "sensitivity": …}: the JSON lines as objects."""
        return {"events": [json.loads(e.to_json()) for e in self.events], "sensitivity": dict(self.sensitivity)}

    def to_frame(self, backend: Backend = "pandas") -> Any:
        """One row an event."""
        names = ("t_s", "since_s", "parameter", "value", "sd", "healthy", "fault", "confidence", "phase")
        return frame_of({name: [getattr(e, name) for e in self.events] for name in names}, backend)

    def plot(self, axes: Any = None) -> Any:
        """Events over time, one line a channel, from when each began to show to when it was named."""
        axes = _axes() if axes is None else axes
        for e in self.events:
            axes.plot([e.since_s, e.t_s], [e.parameter] * 2, "-")
            axes.plot([e.t_s], [e.parameter], "o")
            axes.annotate(e.fault, (e.t_s, e.parameter))
        axes.set_xlabel("t, s")
        return axes


def monitor_result(done: Mapping[str, Any]) -> MonitorResult:
    """A MonitorResult of what the compiled part gives."""
    lines = done["json"].splitlines()
    return MonitorResult(
        _json=done["json"],
        text=done["text"],
        notes=tuple(done["notes"]),
        page=done["page"],
        first=done["first"],
        outcome=done["outcome"],
        events=tuple(event_of(line) for line in lines[:-1]),
        sensitivity=Frozen(json.loads(lines[-1])),
        rows_used=done["rows"],
        q15_header=done["q15_header"],
    )


def compare_result(done: Mapping[str, Any]) -> CompareResult:
    """A CompareResult of what the compiled part gives."""
    return CompareResult(
        _json=done["json"], text=done["text"], notes=tuple(done["notes"]), page=done["page"], first=done["first"]
    )


@dataclass(frozen=True)
class Column:
    """A column of a log: how it is made of the file's fields, and its values as far as they are kept.

    ``rule`` is the formula, ``made_of`` the fields in it, ``unit`` theirs in the file and ``factor`` what makes SI of
    it (None where it is more than a factor). ``needs`` names what is not known for it. ``first``, ``least`` and
    ``largest`` are SI, None where ``kept`` is False.
    """

    name: str
    rule: str
    made_of: tuple[str, ...]
    unit: str = ""
    factor: float | None = None
    needs: tuple[str, ...] = ()
    first: float | None = None
    least: float | None = None
    largest: float | None = None

    @property
    def kept(self) -> bool:
        """Whether it is there."""
        return self.first is not None


@dataclass(frozen=True)
class Dropped:
    """Rows that are none: how many, the line of the first (of a frame its row + 2), and why."""

    rows: int
    first_line: int
    why: str


@dataclass(frozen=True)
class ColumnsResult(Result):
    """What is made of a log, column by column.

    Attributes
    ----------
    format, about : str
        the format by name, and in words
    rows, rows_kept : int
    columns : mapping of name to Column
    voltage : str
        what the voltage is made of, where the format says it
    dropped : tuple of Dropped
    unused : tuple of str
        fields of the file that nothing is made of
    regime : str or None
        None where there is none yet; ``regime_why`` says why
    missing : tuple of str
        what a fit would still want, with the option that says it
    warnings : tuple of str
        what physics doubts
    """

    file: str = ""
    format: str = ""
    about: str = ""
    rows: int = 0
    rows_kept: int = 0
    columns: Mapping[str, Column] = field(default_factory=dict)
    voltage: str = ""
    dropped: tuple[Dropped, ...] = ()
    unused: tuple[str, ...] = ()
    regime: str | None = None
    regime_why: str = ""
    missing: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def to_frame(self, backend: Backend = "pandas") -> Any:
        """One row a column: column, rule, unit, factor, first, least, largest."""
        columns = self.columns.values()
        frame: dict[str, list[Any]] = {"column": [c.name for c in columns]}
        for name in ("rule", "unit"):
            frame[name] = [getattr(c, name) for c in columns]
        for name in ("factor", "first", "least", "largest"):
            frame[name] = [_number(getattr(c, name)) for c in columns]
        return frame_of(frame, backend)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>"


def columns_result(done: Mapping[str, Any]) -> ColumnsResult:
    """A ColumnsResult of what the compiled part gives."""
    found = json.loads(done["json"])
    return ColumnsResult(
        _json=done["json"],
        text=done["text"],
        notes=tuple(done["notes"]),
        file=found["file"],
        format=found["format"],
        about=found["about"],
        rows=found["rows"],
        rows_kept=found["rows_kept"],
        columns=Frozen(
            {
                c["name"]: Column(
                    name=c["name"],
                    rule=c["rule"],
                    made_of=tuple(c["from"]),
                    unit=c.get("unit", ""),
                    factor=c.get("factor"),
                    needs=tuple(c.get("needs", ())),
                    first=c.get("first"),
                    least=c.get("least"),
                    largest=c.get("largest"),
                )
                for c in found["columns"]
            }
        ),
        voltage=found.get("voltage", ""),
        dropped=tuple(Dropped(d["rows"], d["first_line"], d["why"]) for d in found["dropped"]),
        unused=tuple(found["unused"]),
        regime=found["regime"],
        regime_why=found["regime_why"],
        missing=tuple(found["missing"]),
        warnings=tuple(found["warnings"]),
    )
