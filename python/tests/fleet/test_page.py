"""The page: names that want to be script, one file without requests, what a click shows, tables that can be had."""

import json
import re

import pyarrow as pa
import pytest
from browser import looked_at

from dqwatch.fleet.compare import compare
from dqwatch.fleet.page import page
from dqwatch.fleet.simulated.planted import drawn
from dqwatch.fleet.simulated.short import windows
from dqwatch.fleet.windows import windows_of

NASTY = [
    '</script><script>throw "named"</script>',
    '<img src=x onerror="throw 1">',
    "=cmd|' /C calc'!A0",
    "${1}`'\"\\",
    "é\u2028\u0000x",
    "</ScRiPt >",
    "<!--",
    "@DATA@",
    "@SCRIPT@",
]


def renamed(table, names):
    motors = table["motor"].to_pylist()
    return table.set_column(table.column_names.index("motor"), "motor", pa.array([names.get(m, m) for m in motors]))


@pytest.fixture(scope="module")
def shown():
    table = windows(drawn(5, 150, each=1))
    loud = [s.motor for s in compare(windows_of(table)).standing]
    healthy = sorted(set(table["motor"].to_pylist()) - set(loud) - {"M00007"})
    table = renamed(table, dict(zip([*loud, *healthy], NASTY, strict=False)))
    w = windows_of(table)
    c = compare(w)
    return w, c, page(w, c, table), table


def test_names_reach_no_script_and_no_markup(shown):
    w, _c, text, _t = shown
    assert set(NASTY) <= set(w.motors)
    assert text.count("<script") == 2 and text.count("</script") == 2 and "<img" not in text
    script = re.search(r"<script>(.*)</script>", text, re.S).group(1)
    for name in w.motors:
        assert name not in script
    island = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S).group(1)
    assert not set("<>&") & set(island)
    assert json.loads(island)["motors"] == w.motors
    for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "http:", "https:"):
        assert word not in script.replace("http://www.w3.org/2000/svg", "")


def test_the_page_is_a_pure_function_of_the_windows(shown):
    _w, _c, text, table = shown
    assert page(windows_of(table), compare(windows_of(table)), table) == text


@pytest.mark.parametrize("width", [1280, 500])
def test_the_first_screen_says_who_stands_out(shown, tmp_path, width):
    _w, c, text, _t = shown
    seen = looked_at(
        text,
        tmp_path,
        """
        const canvas = document.getElementById("glance"), data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
        let painted = 0; for (let k = 3; k < data.length; k += 4) painted += data[k] > 40;
        return { requests: performance.getEntriesByType("resource").length, wide: document.documentElement.scrollWidth - innerWidth,
          title: document.getElementById("title").textContent, scripts: document.scripts.length, images: document.images.length,
          names: [...document.querySelectorAll("#standing .name")].map((e) => e.textContent), painted,
          multiples: document.querySelectorAll("#drifts svg").length, circles: document.querySelectorAll("#drifts circle").length,
          top: document.querySelector("#standing .row").getBoundingClientRect().bottom, rows: document.querySelectorAll("#types tbody tr").length };
    """,
        width,
    )
    assert seen["requests"] == 0 and seen["wide"] <= 0 and seen["images"] == 0 and seen["scripts"] == 3
    assert seen["title"].startswith(f"{len(c.standing)} of 150 motors stand out")
    single = [s.motor for s in c.standing if s.cause != "batch"]
    assert [n for n in seen["names"] if not n.startswith("batch ")] == single
    assert seen["painted"] > 1000 and seen["top"] < 900
    drifting = sum(any(x.what == "drift" for x in s.signs) for s in c.standing)
    assert seen["multiples"] == drifting > 0 and seen["circles"] == 8 * drifting
    assert seen["rows"] == len(c.of)


def test_a_click_opens_a_motors_own_page_and_tables_can_be_had(shown, tmp_path):
    w, c, text, _t = shown
    first = next(s for s in c.standing if s.cause != "batch")
    seen = looked_at(
        text,
        tmp_path,
        """
        const saved = []; URL.createObjectURL = (blob) => { saved.push(blob); return "#"; };
        HTMLAnchorElement.prototype.click = function () { saved.push(this.download); };
        document.getElementById("export-motors").click();
        document.getElementById("export-types").click();
        const motors = await saved[0].text();
        document.querySelector("#standing button.row").click();
        const one = document.getElementById("one");
        const found = { hidden: document.getElementById("fleet").hidden, title: one.querySelector("h1").textContent, plots: one.querySelectorAll("svg").length,
          cause: one.querySelector("h2").textContent, signs: one.querySelectorAll("tbody tr").length };
        one.querySelector("button").click();
        const search = document.getElementById("search"); search.value = "M00007"; search.dispatchEvent(new Event("input"));
        return { ...found, back: !document.getElementById("fleet").hidden, motors, files: saved.filter((s) => typeof s === "string"),
          rows: document.querySelectorAll("#motors tbody tr").length };
    """,
    )
    assert seen["hidden"] and seen["back"] and seen["title"] == first.motor
    assert seen["cause"].replace(" ", "_") == first.cause and seen["signs"] == len(first.signs)
    assert seen["plots"] == sum(w.motors.index(first.motor) in o.motors for o in c.of)
    assert seen["rows"] == 1 and seen["files"] == ["motors.csv", "types.csv"]
    lines = seen["motors"].removesuffix("\r\n").split("\r\n")
    assert len(lines) == 151
    # What a spreadsheet would run is told to be a text.
    assert any(line.startswith("'=cmd") for line in lines) and not any(line.startswith("=") for line in lines)


def test_a_motor_that_is_not_compared_is_not_called_healthy(tmp_path):
    table = windows(drawn(5, 4, each=0, batch=2))
    w = windows_of(table)
    seen = looked_at(
        page(w, compare(w), table),
        tmp_path,
        """
        document.querySelector("#motors tr.go").click();
        return { title: document.getElementById("title").textContent, said: document.querySelector("#one h2").textContent };
    """,
    )
    assert seen == {"title": "None of 4 motors is compared.", "said": "Not compared"}
