"""Results are frozen, and show themselves as frames, plots and in notebooks."""

from __future__ import annotations

import dataclasses
import html
import inspect
import json
import pickle
import pydoc
import re
from pathlib import Path

import numpy as np
import pytest
from chrome import Chrome

import dqwatch


@pytest.fixture(scope="module")
def found(servo: dqwatch.SimResult) -> dqwatch.FitResult:
    return dqwatch.fit(servo, pole_pairs=4)


def test_frozen(found: dqwatch.FitResult) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.verdict = "clean"  # type: ignore[misc]
    with pytest.raises(TypeError):
        found.parameters["R_ohm"] = None  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.parameters["R_ohm"].value = 0.0  # type: ignore[misc]


def test_json_is_the_values(found: dqwatch.FitResult) -> None:
    read = json.loads(found.to_json())
    assert read == found.to_dict() and read["schema"] == "dqwatch.parameters/1"
    for name, p in found.parameters.items():
        assert read["parameters"][name]["value"] == p.value


def test_pickled(found: dqwatch.FitResult, servo: dqwatch.SimResult, weak: dqwatch.SimResult) -> None:
    for done in (
        found,
        dqwatch.trace(servo, pole_pairs=4, effects=["dead_time"]),
        dqwatch.compare(servo, pole_pairs=4),
        dqwatch.monitor(weak, pole_pairs=4),
        dqwatch.columns(servo, pole_pairs=4),
        servo,
    ):
        again = pickle.loads(pickle.dumps(done))
        assert type(again) is type(done) and again.to_json() == done.to_json() and str(again) == str(done)
    again = pickle.loads(pickle.dumps(found))
    assert again == found and again.parameters == pickle.loads(pickle.dumps(found.parameters))
    with pytest.raises(TypeError):
        again.parameters["R_ohm"] = None


def test_frames(found: dqwatch.FitResult) -> None:
    pandas = pytest.importorskip("pandas")
    frame = found.to_frame().set_index("parameter")
    assert frame.loc["psi_Wb", "value"] == found.parameters["psi_Wb"].value and frame.loc["psi_Wb", "unit"] == "Wb"
    assert pandas.isna(frame.loc["pole_pairs", "sd"])
    polars = pytest.importorskip("polars")
    assert isinstance(found.to_frame("polars"), polars.DataFrame)
    with pytest.raises(dqwatch.UsageError):
        found.to_frame("numpy")  # type: ignore[arg-type]


def test_plots(found: dqwatch.FitResult, weak: dqwatch.SimResult, servo: dqwatch.SimResult) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    pytest.importorskip("pandas")
    matplotlib.use("Agg")
    bars = found.plot().containers[0]
    p = found.parameters["R_ohm"]
    assert p.sd is not None and bars[0].get_width() == pytest.approx(100 * p.sd / p.value)
    watched = dqwatch.monitor(weak, machine={"pole_pairs": 4})
    assert len(watched.plot().texts) == len(watched.events) > 0
    three = servo.plot()
    assert len(three) == 3 and (three[2].lines[0].get_ydata() == servo["w_m_rad_s"]).all()
    traced = dqwatch.trace(servo, pole_pairs=4, effects=["dead_time"])
    assert [bar.get_height() for bar in traced.plot().containers[0]] == [traced.residual_before, traced.residual_after]
    assert dqwatch.compare(servo, pole_pairs=4).plot().lines


def test_compare_frame(servo: dqwatch.SimResult) -> None:
    pytest.importorskip("pandas")
    frame = dqwatch.compare(servo, pole_pairs=4).to_frame().set_index("parameter")
    for who in ("float", "q15", "reference"):
        assert frame.loc["psi_Wb", f"{who}_value"] == pytest.approx(0.12, rel=0.01)


def test_notebook(found: dqwatch.FitResult, servo: dqwatch.SimResult) -> None:
    page = found._repr_html_()
    assert "psi_Wb" in page and "usable" in page and page.count("<table>") == page.count("</table>") == 1
    nasty = dataclasses.replace(found, verdict="<script>")
    assert "<script>" not in nasty._repr_html_()
    assert "i_q_A" in servo._repr_html_()


def test_notebooks_show_the_first_screen(servo: dqwatch.SimResult, weak: dqwatch.SimResult) -> None:
    for done, last in (
        (dqwatch.trace(servo, pole_pairs=4, effects=["dead_time"]), '<p class="hint">'),
        (dqwatch.compare(servo, pole_pairs=4), '<p class="hint">'),
        (dqwatch.monitor(weak, pole_pairs=4), "<figure"),
    ):
        (shown,) = re.findall(r'<iframe srcdoc="([^"]*)"', done._repr_html_())
        assert "<" not in shown
        first, page = (re.search("<header>.*</main>", p, re.S) for p in (html.unescape(shown), done.to_html()))
        assert first and page and last in first[0]
        assert page[0].startswith(first[0].removesuffix("</main>")) and len(first[0]) < len(page[0])


def test_the_frame_is_as_high_as_its_page(weak: dqwatch.SimResult, tmp_path: Path) -> None:
    shown = dqwatch.monitor(weak, pole_pairs=4)._repr_html_()
    path = tmp_path / "cell.html"
    path.write_text(f'<!doctype html><meta charset="utf-8"><body>{shown}')
    chrome = Chrome(tmp_path / "profile")
    try:
        frame = "document.querySelector('iframe')"
        inside = f"{frame}.contentDocument?.body?.offsetHeight"
        chrome.size(1200, 900)
        chrome.go(path.as_uri())
        chrome.until(f"{frame} && {inside} > 700 && {frame}.clientHeight === {inside}")
        wide = chrome.run(inside)
        chrome.size(700, 900)
        chrome.until(f"{inside} > {wide} && {frame}.clientHeight === {inside}")
        chrome.size(1200, 900)
        chrome.until(f"{inside} === {wide} && {frame}.clientHeight === {inside}")
        assert chrome.console == []
    finally:
        chrome.close()


def test_what_is_not_usable_is_said_first(found: dqwatch.FitResult, servo: dqwatch.SimResult) -> None:
    noise = np.random.default_rng(1).standard_normal((2, 500))
    log = {name: column[:500] for name, column in servo.columns.items()}
    log |= {"v_d_V": log["v_d_V"] + 10 * noise[0], "v_q_V": log["v_q_V"] + 10 * noise[1]}
    traced = dqwatch.trace(log, pole_pairs=4, effects=["dead_time"])
    assert traced.sentence.endswith(" Parameters not usable: L_d, L_q, ψ.")
    assert traced.sentence == traced.to_dict()["sentence"] == str(traced).splitlines()[0]
    assert html.escape("Parameters not usable: L_d, L_q, ψ.") in traced._repr_html_()
    doubtful = dataclasses.replace(found.parameters["Ld_H"], usable=False, why="its deviation is too large")
    said = dataclasses.replace(found, parameters={**found.parameters, "Ld_H": doubtful})._repr_html_()
    assert "not usable: Ld_H;" in said.partition("</p>")[0] and "not usable" not in found._repr_html_()


def test_help_is_enough_to_work_by() -> None:
    for name in dqwatch.__all__:
        thing = getattr(dqwatch, name)
        if not inspect.isclass(thing) and not inspect.isfunction(thing):
            continue
        assert inspect.getdoc(thing), name
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                assert inspect.getdoc(value), f"{name}.{member}"
    text = pydoc.plain(pydoc.render_doc(dqwatch.fit))
    for word in ("t_s v_d_V v_q_V i_d_A i_q_A w_m_rad_s", "shape (rows,)", "pole_pairs", "Raises", "Ctrl-C"):
        assert word in text


def test_a_parameter_speaks() -> None:
    p = dqwatch.Parameter("psi_Wb", 0.12001, 1.2e-5, "Wb")
    assert str(p) == "0.12001 ± 1.2e-05 Wb" and f"{p:.3f}" == "0.120"
