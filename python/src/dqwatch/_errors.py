"""What dqwatch raises: one line that says what is wrong, where, and what to do."""

from __future__ import annotations


class Error(Exception):
    """Anything that dqwatch refuses or cannot do; ``str()`` is one line.

    Attributes
    ----------
    file : str or None
        the file at fault, where there is one
    line : int or None
        its line, from 1; None where there is no line to point at, and of frames and arrays
    row : int or None
        of frames and arrays the row at fault, from 0
    advice : str
        what was expected, or what to do; may be empty
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: int | None = None,
        row: int | None = None,
        advice: str | None = None,
    ) -> None:
        # Names out of a log may hold anything; a line stays one.
        super().__init__("".join(c if c.isprintable() else "?" for c in message))
        self.file = file
        self.line = line
        self.row = row
        self.advice = advice_of(message) if advice is None else advice

    def __reduce__(self) -> tuple[object, ...]:
        return _again, (type(self), str(self), self.file, self.line, self.row, self.advice)


class InputError(Error):
    """A log, a machine file or a state that cannot be read, or is invalid."""


class UsageError(Error):
    """A call that contradicts itself, or a value that its argument does not take."""


def _again(kind: type[Error], message: str, file: str | None, line: int | None, row: int | None, advice: str) -> Error:
    return kind(message, file=file, line=line, row=row, advice=advice)


def advice_of(message: str) -> str:
    """What stands behind the last semicolon of a message; empty where there is none."""
    _, semicolon, advice = message.rpartition("; ")
    return advice if semicolon else ""


def kind_of(value: object) -> str:
    """The type of a value with its article: "an int"."""
    name = type(value).__name__
    return f"{'an' if name[0].lower() in 'aeio' else 'a'} {name}"


def input_error(file: str, line: int, text: str, table: bool) -> InputError:
    """An InputError of the compiled part; ``table``: ``file`` is a frame's name, and lines are its rows."""
    if not table:
        return InputError(f"{file}:{line}: {text}", file=file, line=line or None, advice=advice_of(text))
    row = line - 2 if line >= 2 else None
    where = file if row is None else f"{file}, row {row}"
    return InputError(f"{where}: {text}", row=row, advice=advice_of(text))
