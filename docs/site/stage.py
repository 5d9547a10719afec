#!/usr/bin/env python3
"""The site's pages, from where they stand in the tree and from what the code's tables print, into one folder.

usage: stage.py SOURCE --dqwatch PROGRAM --catalogue PROGRAM --xml DOXYGEN'S   write all pages to SOURCE
       stage.py --check                                                       links, anchors and nav as they stand
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import posixpath
import re
import shutil
import subprocess
import sys

import c_reference
import equations

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = ROOT / "docs/site"
MATH_FONT = pathlib.Path("/usr/share/texmf/fonts/opentype/public/tex-gyre-math/texgyretermes-math.otf")
MATH_FONT_LICENCE = pathlib.Path("/usr/share/doc/fonts-texgyre-math/copyright")

# What is written here of what stands elsewhere.
GENERATED = ["formats.md", "effects.md", "faults.md", "c.md", "c-q15.md", "licence.md"]


def sources() -> dict[str, str]:
    """Of each page that is a file of the tree, where it stands there."""
    found = {"README.md": "index.md", "DESIGN.md": "design.md", "CONTRIBUTING.md": "contributing.md",
             "CHANGELOG.md": "changelog.md"}
    for page in sorted((ROOT / "docs").glob("*.md")):
        found[f"docs/{page.name}"] = page.name.lower()
    for page in sorted((HERE / "pages").glob("*.md")):
        found[f"docs/site/pages/{page.name}"] = page.name
    if (ROOT / "python/README.md").exists():
        found["python/README.md"] = "python-readme.md"
    return found


LINK = re.compile(r"(?<!\\)\]\(([^)\s]+)\)")
FENCE = re.compile(r"^( *)(```|~~~).*?^\1\2 *$", re.S | re.M)


def outside_code(text: str, change: "re._Pattern[str]", to: object) -> str:
    """re.sub where no code stands."""
    parts = re.split(r"(^ *```.*?^ *``` *$|`[^`\n]+(?:\n[^`\n]+)?`)", text, flags=re.S | re.M)
    return "".join(part if n % 2 else change.sub(to, part) for n, part in enumerate(parts))  # type: ignore[arg-type]


def slug(heading: str) -> str:
    """As GitHub makes an anchor of a heading."""
    plain = re.sub(r"[`*]|\]\([^)]*\)|\[", "", heading.strip().lower())
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


def anchors(text: str) -> set[str]:
    bare = FENCE.sub("", text)
    return {slug(line.lstrip("#")) for line in re.findall(r"^#+ .*$", bare, re.M)}


def resolve(page: str, target: str) -> str:
    """A link's target as a path from the tree's root."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), target))


def linked(page: str, text: str, pages: dict[str, str], out: pathlib.Path) -> str:
    """A page's links, to where what they mean stands in the site."""

    def of(match: re.Match[str]) -> str:
        target, _, anchor = match[1].partition("#")
        if "://" in target or not target:
            return match[0]
        path = resolve(page, target)
        hash_ = f"#{anchor}" if anchor else ""
        if path in pages:
            return f"]({pages[path]}{hash_})"
        if page.startswith("docs/site/pages/") and (target in pages.values() or target in GENERATED or target in notebook_pages()):
            return match[0]
        found = ROOT / path
        if not found.is_file():
            raise SystemExit(f"{page}: no {target} ({path})")
        place = out / "files" / path
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(found, place)
        return f"](files/{path}{hash_})"

    text = outside_code(text, LINK, of)
    # A page that is named in the text is a link to it.
    return re.sub(r"(?<!\[)`((?:docs/)?[A-Za-z]+\.md)`(?!\])",
                  lambda m: f"[`{m[1]}`]({pages[m[1]]})" if m[1] in pages else m[0], text)


CITATION = re.compile(r"(?<!\*)\(E(\d+)\)(?!\*)")


def cited(text: str, known: set[str], up: str) -> str:
    """(E8) as a link to its entry; `up` leads to the folder of the equations."""
    return outside_code(text, CITATION, lambda m: f"[(E{m[1]})]({up}equations.md#e{m[1]})" if m[1] in known else m[0])


def equation_page(text: str) -> str:
    text = equations.typeset_page(text)
    return re.sub(r"^\*\*\(E(\d+)\)\*\*", r'<span class="entry" id="e\1" markdown="span">**(E\1)**</span>', text, flags=re.M)


LIST = re.compile(r"^(?![-*|#>\d ]|$)(.*\n)(?=(?:[-*]|1\.) )", re.M)


def lists(text: str) -> str:
    """An empty line before a list, which GitHub does without."""
    parts = re.split(r"(^ *```.*?^ *``` *$)", text, flags=re.S | re.M)
    return "".join(part if n % 2 else LIST.sub(r"\1\n", part) for n, part in enumerate(parts))


def formats_page(program: str) -> str:
    rows = json.loads(subprocess.run([program, "formats", "--json"], check=True, capture_output=True, text=True).stdout)
    listed = "\n".join(f"| `{row['name']}` | {row['about']} |" for row in rows["formats"])
    return (HERE / "formats.md").read_text().replace("FORMATS", listed)


def licence_page() -> str:
    return "# Licence\n\n" + (ROOT / "LICENSE").read_text()


def write(args: argparse.Namespace) -> None:
    out = pathlib.Path(args.source)
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    pages = sources()
    known = set(re.findall(r"^\*\*\(E(\d+)\)\*\*", (ROOT / "docs/EQUATIONS.md").read_text(), re.M))
    made = {page: (ROOT / source).read_text() for source, page in pages.items()}
    made = {page: linked(source, lists(made[page]), pages, out) for source, page in pages.items()}
    catalogue = [subprocess.run([args.catalogue, what], check=True, capture_output=True, text=True).stdout
                 for what in ("effects", "faults")]
    made |= {"formats.md": formats_page(args.dqwatch), "effects.md": catalogue[0], "faults.md": catalogue[1],
             "licence.md": licence_page()}
    made |= c_reference.pages(pathlib.Path(args.xml))
    made |= {page: (pathlib.Path(args.notebooks) / pathlib.Path(page).name).read_text() for page in notebook_pages()}
    made = {page: cited(text, known, "../" * page.count("/")) for page, text in made.items()}
    made["equations.md"] = equation_page(made["equations.md"])
    for page, text in made.items():
        (out / page).parent.mkdir(parents=True, exist_ok=True)
        (out / page).write_text(text)
    shutil.copytree(ROOT / "docs/pictures", out / "pictures")
    shutil.copytree(HERE / "style", out / "style")
    for pictures in pathlib.Path(args.notebooks).glob("*_files"):
        shutil.copytree(pictures, out / "notebooks" / pictures.name)
    if MATH_FONT.exists():
        shutil.copyfile(MATH_FONT, out / "style" / MATH_FONT.name)
        shutil.copyfile(MATH_FONT_LICENCE, out / "style" / "texgyre-copyright.txt")


def check() -> list[str]:
    """What is wrong with links, anchors, nav and formulas, a line each."""
    wrong: list[str] = []
    pages = sources()
    texts = {source: (ROOT / source).read_text() for source in pages}
    of_page = {page: source for source, page in pages.items()}
    for source, text in texts.items():
        found: list[str] = []
        outside_code(text, LINK, lambda m: found.append(m[1]) or "")
        for target in found:
            if "://" in target:
                continue
            path, _, anchor = target.partition("#")
            own = source.startswith("docs/site/pages/")
            if own and (path in GENERATED or path in notebook_pages()):
                continue
            meant = of_page[path] if own and path in of_page else resolve(source, path) if path else source
            if not (ROOT / meant).is_file():
                wrong.append(f"{source}: no {target}")
            elif anchor and meant in texts and anchor not in anchors(texts[meant]):
                wrong.append(f"{source}: {meant} has no heading for #{anchor}")
    nav = re.findall(r"^ *- [^:]+: (\S+\.md)$", (HERE / "mkdocs.yml").read_text(), re.M)
    there = set(pages.values()) | set(GENERATED) | notebook_pages()
    wrong += [f"docs/site/mkdocs.yml: nobody makes {page}" for page in nav if page not in there]
    wrong += [f"docs/site/mkdocs.yml: {of_page.get(page, page)} has no line ({page})" for page in there if page not in nav]
    return wrong + equations.mistakes((ROOT / "docs/EQUATIONS.md").read_text())


def notebook_pages() -> set[str]:
    return {f"notebooks/{page.stem}.md" for page in (ROOT / "docs/notebooks").glob("*.py")}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", nargs="?")
    parser.add_argument("--dqwatch")
    parser.add_argument("--catalogue")
    parser.add_argument("--xml")
    parser.add_argument("--notebooks", help="folder of notebooks.py")
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    if args.check:
        wrong = check()
        print("\n".join(wrong) or "ok")
        return 1 if wrong else 0
    write(args)
    return 0


if __name__ == "__main__":
    sys.exit(main())
