"""Doxygen's XML of the public headers, as two pages: float, and fixed point."""

from __future__ import annotations

import pathlib
import re
from xml.etree import ElementTree

from c_filter import OBJECTS, PARTS

Element = ElementTree.Element
# What a user meets first.
FIRST = ["dqw_sample", "dqw_nameplate", "dqw_monitor", "dqw_estimator", "dqw_shaft", "dqw_reading", "dqw_parameter",
         "dqw_fault_name", "dqw_status", "dqw_why", "dqw_stage", "dqw_text", "dqw_effect_name", "dqw_parts"]
HEAD = {
    "c.md": """# C reference

`#include "dqw.h"` has what a controller needs; `dqw_paper.h` the paper's Learners. The guide is
[dqwatch in a motor controller](integration.md); the fixed-point port stands in [its own page](c-q15.md). Members of
objects are the library's own and not listed.
""",
    "c-q15.md": """# C reference, fixed point

The same calls with `_q15` behind them, in whole numbers: [what differs](numerics.md). Enumerations of faults, stages,
reasons and effects are those of [the float library](c.md).
"""}


def text_of(element: Element | None) -> str:
    """A description as Markdown."""
    if element is None:
        return ""
    out = element.text or ""
    for child in element:
        inner = text_of(child)
        if child.tag in ("para",):
            out += inner.strip() + "\n\n"
        elif child.tag == "itemizedlist":
            out += "\n\n" + inner
        elif child.tag == "listitem":
            out += "- " + inner.strip().replace("\n\n", " ") + "\n"
        elif child.tag in ("bold", "emphasis"):
            out += f"**{inner}**"
        elif child.tag == "computeroutput":
            out += f"`{inner}`"
        elif child.tag in ("ndash", "mdash"):
            out += "–"
        elif child.tag == "linebreak":
            out += "\n"
        elif child.tag == "verbatim":
            out += f"`{inner.strip()}`"
        else:
            out += inner
        out += child.tail or ""
    return out


def plain(text: str) -> str:
    """Names and powers stand as they are; a name of ours is code."""
    text = re.sub(r"(?<![`\w])((?:dqw|DQW)_\w+(?:\*|\(\))?)(?!\w)", r"`\1`", text)
    return re.sub(r"(?<!\*)\*(?!\*)(?=\w)", r"\\*", text).replace("<", "&lt;")


def described(member: Element) -> str:
    brief, more = text_of(member.find("briefdescription")).strip(), text_of(member.find("detaileddescription")).strip()
    return plain("\n\n".join(part for part in (brief, more) if part)).replace("docs/EQUATIONS.md", "the equations")


def cell(member: Element) -> str:
    return re.sub(r"\s*\n+\s*", " ", described(member)).replace("|", "\\|")


def type_of(member: Element) -> str:
    return "".join(member.find("type").itertext()) if member.find("type") is not None else ""


def function(member: Element) -> str:
    name = member.findtext("name")
    if not described(member):
        return ""
    arguments = member.findtext("argsstring")
    signature = f"{type_of(member)} {name}{arguments};".replace("* ", "*").replace(" *", " *")
    return f"### {name} {{#{name}}}\n\n```c\n{wrapped(signature)}\n```\n\n{described(member)}\n\n"


def wrapped(signature: str) -> str:
    if len(signature) <= 76:
        return signature
    head, arguments = signature.split("(", 1)
    return head + "(\n    " + ",\n    ".join(re.split(r", (?![^(]*\))", arguments.removesuffix(");"))) + ");"


def enumeration(member: Element) -> str:
    name = member.findtext("name") or ""
    rows = [f"| `{value.findtext('name')}` | {cell(value)} |" for value in member.findall("enumvalue")]
    named = f"enum {name}" if name and not name.startswith("@") else "Constants"
    return f"### {named} {{#{name.strip('@')}}}\n\n{described(member)}\n\n| name | |\n| --- | --- |\n" + "\n".join(rows) + "\n\n"


def structure(xml: pathlib.Path, refid: str) -> str:
    compound = ElementTree.parse(xml / f"{refid}.xml").getroot().find("compounddef")
    assert compound is not None
    name = compound.findtext("compoundname") or ""
    if name in PARTS:
        return ""
    rows = []
    for member in compound.iter("memberdef"):
        size = member.findtext("argsstring") or ""
        rows.append(f"| `{type_of(member)} {member.findtext('name')}{size}` | {cell(member)} |")
    table = "| member | |\n| --- | --- |\n" + "\n".join(rows) + "\n\n" if rows else ""
    return f"### {name} {{#{name}}}\n\n{described(compound)}\n\n{table}"


def macros(members: list[Element]) -> str:
    rows = [f"| `{m.findtext('name')}` | {cell(m)} |" for m in members
            if described(m) and m.find("param") is None]
    return "| constant | |\n| --- | --- |\n" + "\n".join(rows) + "\n\n" if rows else ""


def header(xml: pathlib.Path, file: Element) -> str:
    name = file.findtext("compoundname") or ""
    members = list(file.iter("memberdef"))
    of = {kind: [m for m in members if m.get("kind") == kind] for kind in ("function", "enum", "define")}
    body = "".join(structure(xml, inner.get("refid") or "") for inner in file.findall("innerclass"))
    body += "".join(map(enumeration, of["enum"])) + "".join(map(function, of["function"])) + macros(of["define"])
    return f"## {name} {{#{name.replace('.', '_')}}}\n\n{described(file)}\n\n{body}"


def rank(file: Element) -> tuple[int, str]:
    stem = (file.findtext("compoundname") or "").removesuffix(".h").removesuffix("_q15")
    return FIRST.index(stem) if stem in FIRST else len(FIRST), stem


def pages(xml: pathlib.Path) -> dict[str, str]:
    """Both pages, by name."""
    files = []
    for path in xml.glob("*_8h.xml"):
        compound = ElementTree.parse(path).getroot().find("compounddef")
        if compound is not None:
            files.append(compound)
    out = dict(HEAD)
    for file in sorted(files, key=rank):
        location = file.find("location")
        page = "c-q15.md" if location is not None and "port_q15" in (location.get("file") or "") else "c.md"
        out[page] += header(xml, file)
    return out
