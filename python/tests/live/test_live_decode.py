from __future__ import annotations

import json
import math
import random
import string

import numpy as np
import pytest

from dqwatch.live.decode import COLUMNS, LONGEST_LINE, Decoder, Format, format_of, rows_of
from dqwatch.live.state import slug

HEADER = b"t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n"


def test_csv_in_any_pieces_is_the_same() -> None:
    text = HEADER + b"".join(b"%d,1,2,3,4,%d\r\n" % (k, -k) for k in range(50))
    for size in (1, 7, 64, 10_000):
        decoder = Decoder(format_of("csv", 4, {}), "m")
        rows = [r for k in range(0, len(text), size) for r in decoder.feed(text[k : k + size])]
        assert [r["t_s"] for _, r in rows] == list(range(50))
        assert rows[9] == ("m", {"t_s": 9, "v_d_V": 1, "v_q_V": 2, "i_d_A": 3, "i_q_A": 4, "w_m_rad_s": -9})
        assert decoder.counts.broken == 0


def test_units_and_names_of_formats() -> None:
    simplefoc = Decoder(format_of("simplefoc", 7, {}), "m")
    ((_, row),) = simplefoc.feed(b"5.0000\t2.5000\t-0.5000\t1200.0000\t-30.0000\t10.5000\t0.2500\n")
    assert row == pytest.approx(
        {"v_q_V": 2.5, "v_d_V": -0.5, "i_q_A": 1.2, "i_d_A": -0.03, "w_m_rad_s": 10.5, "theta_e_rad": 1.75}
    )
    mesc = Decoder(format_of("mesc", 7, {}), "m")
    line = {"ehz": 70.0, "id": -1, "iq": 2, "Vd": -3, "Vq": 12, "TMOT": 300.15, "error": 0, "text": "x"}
    ((_, row),) = mesc.feed(json.dumps(line).encode() + b"\n")
    # 70 Hz electrical of 7 pole pairs are 10 turns a second.
    assert row["w_m_rad_s"] == pytest.approx(20 * math.pi)
    assert row["temp_winding_C"] == pytest.approx(27.0)
    own = Decoder(format_of("json", 4, {"i_q_A": {"from": "Iq", "scale": 0.001}}), "")
    ((name, row),) = own.feed(b'{"motor":"x","Iq":500,"i_d_A":0,"v_d_V":1,"v_q_V":1,"w_m_rad_s":1}\n')
    assert name == "x" and row["i_q_A"] == 0.5
    for wrong in ({"i_q_mA": "x"}, {"i_q_A": 3}, {"i_q_A": {"scale": 2}}):
        with pytest.raises(ValueError, match="expected"):
            format_of("csv", 4, wrong)


@pytest.mark.parametrize(
    "line",
    [
        b"1,2,3",
        b"1,nan,2,3,4,5",
        b"1,1e300,2,3,4,5",
        b"1,inf,2,3,4,5",
        b"\xff\xfe\x00",
        b"<script>alert(1)</script>",
        b"t_s,v_d_V",
        b"1,2,3,4,5,6,7",
    ],
)
def test_broken_lines_are_counted_and_end_nothing(line: bytes) -> None:
    decoder = Decoder(format_of("csv", 4, {}), "m")
    good = b"1,2,3,4,5,6\n"
    rows = list(decoder.feed(HEADER + good + line + b"\n" + good))
    assert len(rows) == 2
    assert decoder.counts.broken == 1


@pytest.mark.parametrize(
    "line",
    [b"[1]", b"{}", b"null", b"{" * 50_000, b'{"i_d_A":1e999}', b'{"a":"' + b"x" * 100 + b'"}', b'{"v_d_V":true}'],
)
def test_hostile_json_is_counted(line: bytes) -> None:
    decoder = Decoder(Format("json"), "m")
    assert list(decoder.feed(line + b"\n")) == []
    assert decoder.counts.broken == 1


def test_a_line_without_end_takes_no_memory() -> None:
    decoder = Decoder(format_of("csv", 4, {}), "m")
    list(decoder.feed(HEADER))
    for _ in range(100):
        assert list(decoder.feed(b"9" * LONGEST_LINE)) == []
        assert len(decoder._rest) <= LONGEST_LINE
    assert decoder.counts.too_long == 1
    assert len(list(decoder.feed(b"\n1,2,3,4,5,6\n"))) == 1


SIGNALS = {"v_d_V": 1.5, "v_q_V": -2e-3, "i_d_A": 0, "i_q_A": 3.25, "w_m_rad_s": 1e2}
VALUES = [
    "0", "-0", "0.1", "-1.25e-3", "3E2", "1e999", "01", "1.", ".5", "+1", "-", "1e", "0x1", "NaN", "Infinity",
    "-Infinity", "null", "true", "false", '"1"', '""', "[1]", "{}", '{"a":1}', "1 2", "9" * 400, "1e17",
    "999999999.9", "1e9", "1e11", "123456789012345678901234567890", "4.9e-324", "1e-400", '"\\u0041"', '"ü"', "'1'", "",
]  # fmt: skip
ENDS = ["}", "} ", "}\r", "},", "}}", "", "} x", "}\x0c", ",}"]


def drawn_line(draw: random.Random) -> bytes:
    """An object that is whole, or nearly."""
    fields = [("motor", f'"m{draw.randrange(3)}"'), ("t_s", repr(draw.random()))]
    fields += [(n, repr(v)) for n, v in [*SIGNALS.items(), ("Iq", 12.5)]]
    for _ in range(draw.choice([0, 1, 1, 2])):
        name = draw.choice([*COLUMNS, "motor", "Iq", "other", "", "a\tb", "a\\\\b", "ü"])
        fields.insert(draw.randrange(len(fields) + 1), (name, draw.choice(VALUES)))
    if draw.random() < 0.1:
        fields.pop(draw.randrange(len(fields)))
    colon, comma = draw.choice([":", ": ", " :\t"]), draw.choice([",", ", ", " ,\t"])
    text = draw.choice(["{", " {", "{ "]) + comma.join(f'"{n}"{colon}{v}' for n, v in fields)
    return (text + draw.choice(ENDS if draw.random() < 0.2 else ENDS[:1])).encode()


@pytest.mark.parametrize("motor", ["", "m"])
def test_many_lines_at_once_are_what_each_is_alone(motor: str) -> None:
    draw = random.Random(7)
    lines = [drawn_line(draw) for _ in range(20_000)] + [b"", b"\r", b"\x0b", b"\xff", b"{" * 3000, b"9" * 70_000]
    draw.shuffle(lines)
    form = format_of("json", 4, {"i_q_A": {"from": "Iq", "scale": 0.1, "offset": 0.7}, "v_q_V": "v_d_V"})
    many, alone = Decoder(form, motor), Decoder(form, motor)
    parts: dict[str, list[object]] = {}
    for name, some in many.lines(b"\n".join(lines)):
        parts.setdefault(name, []).append(some)
    expected: dict[str, list[object]] = {}
    for line in lines:
        if len(line) <= LONGEST_LINE and line.strip():
            for name, row in alone.message(line):
                expected.setdefault(name, []).append(row)
    assert {n: rows_of(p).tobytes() for n, p in parts.items()} == {n: rows_of(p).tobytes() for n, p in expected.items()}  # type: ignore[arg-type]
    assert many.counts.broken == alone.counts.broken > 1000 and many.counts.too_long == 1
    whole = sum(len(p) for p in parts.values() for p in p if isinstance(p, np.ndarray))
    assert whole > 3000


def test_seconds_since_1970_are_a_time() -> None:
    for kind, line in (
        ("json", json.dumps({"t_s": 1.8e9, **SIGNALS}).encode()),
        ("csv", b"1.8e9," + ",".join(map(str, SIGNALS.values())).encode()),
    ):
        decoder = Decoder(format_of(kind, 4, {}), "m")
        list(decoder.feed(HEADER if kind == "csv" else b""))
        ((_, row),) = decoder.feed(line + b"\n")
        assert row["t_s"] == 1.8e9


NAMES = ["../../etc/passwd", "a/b", "", "<b>", "x" * 5000, "\u202eevil", "a\0b", ".", "..", "+/#"]


@pytest.mark.parametrize("name", NAMES)
def test_no_name_is_a_path_or_a_topic(name: str) -> None:
    made = slug(name)
    assert made and len(made) < 60 and set(made) <= set(string.ascii_letters + string.digits + "_-")
    assert made != slug(name + " ")
    assert slug("left_1") == "left_1"
