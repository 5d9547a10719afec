#!/usr/bin/env python3
"""What stands in docs/EQUATIONS.md as text, against its MathML: by hand where a reading could be wrong, and by numbers
where the same formula is computed from the MathML's own tree and from the text by Python."""

from __future__ import annotations

import math
import pathlib
import re
import sys
from xml.etree import ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "docs/site"))
import equations  # noqa: E402


def tree(text: str) -> str:
    """MathML as nested words, without spaces: frac(a;b), sub(x;i), sup(x;2), sqrt(...)."""

    def of(e: ElementTree.Element) -> str:
        inner = [of(c) for c in e if c.tag != "mspace"]
        short = {"mfrac": "frac", "msub": "sub", "msup": "sup", "msubsup": "subsup", "munder": "under",
                 "munderover": "underover", "mover": "over", "msqrt": "sqrt"}
        if e.tag in short:
            return f"{short[e.tag]}({';'.join(inner) if e.tag != 'msqrt' else ''.join(inner)})"
        return (e.text or "").strip() + "".join(inner)

    return of(ElementTree.fromstring(equations.typeset(text).replace("<wbr>", "")))


BY_HAND = {
    "y = y_base Σ w_i x_i / x_base_i": "y=sub(y;base)∑frac(sub(w;i)sub(x;i);sub(x;base,i))",
    "sin h / h": "frac(sinh;h)",
    "x/ln 2": "x/ln2",
    "sin 1.1/1.1": "sin1.1/1.1",
    "R = (1 − a)/b": "R=frac(1−a;b)",
    "−alpha/2 + √3/2 beta": "−frac(α;2)+frac(sqrt(3);2)β",
    "T/L/(1 + TR/L)": "T/L/(1+frac(TR;L))",
    "p (1 − (R T/2L)(1 − p))": "p(1−(RT/2L)(1−p))",
    "L dy/dt = x − R y": "Lfrac(dy;dt)=x−Ry",
    "i = ∂W/∂ψ": "i=frac(∂W;∂ψ)",
    "2σ²/(4h²T²)": "frac(2sup(σ;2);4sup(h;2)sup(T;2))",
    "N = Σ x_pu² + 1": "N=∑subsup(x;pu;2)+1",
    "s_b,k = a s_b,k−1": "sub(s;b,k)=asub(s;b,k−1)",
    "e^{V²/2s²}/√(1 + W²/s²)": "frac(sup(e;sup(V;2)/2sup(s;2));sqrt(1+frac(sup(W;2);sup(s;2))))",
    "w_i += e": "sub(w;i)+=e",
    "c22 x": "sub(c;22)x",
    "(G⁻¹)_kk": "sub((sup(G;−1));kk)",
    "v̄_d": "sub(over(v;¯);d)",
    "∫_0^π f": "underover(∫;0;π)f",
    "jw_e v": "jsub(w;e)v",
    "x = d cosθ": "x=dcosθ",
    "Σ (−z)^n/(n + 1)!": "∑frac(sup((−z);n);(n+1)!)",
}

# Of these the value is computed twice. Letters are one name each.
BY_NUMBER = [
    "(1 − a)/b", "(L/T) a", "a b/c d", "a/b + c/d e", "s² (1 + 2 r)(a − 2 r b)/L²", "a b / c", "2 a²/(b³ c²)", "√3/2 b",
    "√(a + b)/c", "½ (a + √(a² + 4 a (b² + r)))", "a/(b + r)", "g s (1 − a² (1 − g))/b²", "(a/L)/(1 − b (1 − g))",
    "h = (a (4 a² − 1)/6 + a²)/s²", "−a/2 − √3/2 b", "a − b/c − d", "a (b + c)/d", "1.2 a²/√(b/2)", "sin h / h", "4.6 (1 + √r) a/√b",
]


def value(e: ElementTree.Element, names: dict[str, float]) -> str:
    """MathML as an expression of Python: factors that stand side by side are products."""

    def row(children: list[ElementTree.Element]) -> str:
        out = ""
        product = False
        function = False
        for c in (c for c in children if c.tag != "mspace"):
            if c.tag == "mo":
                text = c.text or ""
                if text in "([":
                    out += ("*" if product else "") + "("
                    product = False
                elif text in ")]":
                    out += ")"
                    product = True
                else:
                    out += {"−": "-", "+": "+", "/": "/", "=": "=="}[text]
                    product = False
                continue
            text = value(c, names)
            if function:
                out += f"({text})"
                function = False
            else:
                out += ("*" if product else "") + text
                function = text == "sin"
            product = not function
        return out

    parts = [c for c in e if c.tag != "mspace"]
    if e.tag == "mn":
        return e.text or ""
    if e.tag == "mi":
        return e.text or ""
    if e.tag == "mfrac":
        return f"(({value(parts[0], names)})/({value(parts[1], names)}))"
    if e.tag == "msup":
        return f"({value(parts[0], names)})**({value(parts[1], names)})"
    if e.tag == "msqrt":
        return f"sqrt({row(parts)})"
    inner = row(list(e))
    return f"({inner})" if e.tag == "mrow" and e.get("class") else inner


def by_python(text: str) -> str:
    """The text as Python, by its own reading: a space or nothing between factors is a product."""
    text = text.replace("−", "-").replace("½", "0.5").replace("sin h", "sin(h)")
    text = re.sub("[²³⁴]", lambda m: "**" + "234"["²³⁴".index(m[0])], text)
    text = re.sub(r"√(\d|[a-z](?:\*\*\d)?)", r"sqrt(\1)", text).replace("√(", "sqrt(")
    text = re.sub(r"(?<=[\w)]) (?=[\w(])", "*", text)
    text = re.sub(r"\)\(", ")*(", text)
    text = re.sub(r"(?<![\w.*])(\d)([a-z])", r"\1*\2", text)
    return text.split("=")[-1]


def main() -> int:
    wrong = []
    for text, expected in BY_HAND.items():
        if (got := tree(text)) != expected:
            wrong.append(f"`{text}` is {got}, not {expected}")
    names = {name: 1.1 + 0.37 * n for n, name in enumerate("abcdeghrsLT")}
    for text in BY_NUMBER:
        made = value(ElementTree.fromstring(equations.typeset(text).replace("<wbr>", "")), names).split("==")[-1]
        scope = {**names, "sqrt": math.sqrt, "sin": math.sin}
        ours, theirs = eval(made, scope), eval(by_python(text), scope)  # noqa: S307
        if not math.isclose(ours, theirs, rel_tol=1e-12):
            wrong.append(f"`{text}` is {made} = {ours}, and {by_python(text)} = {theirs}")
    print("\n".join(wrong) or "ok")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
