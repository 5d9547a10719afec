#!/usr/bin/env python3
"""Whether a built site holds together: every link and every anchor within it leads somewhere, and nothing that a page
loads is another server's.

usage: links.py FOLDER
"""

from __future__ import annotations

import pathlib
import sys
import urllib.parse
from html.parser import HTMLParser

# A tag's attribute that a browser follows by itself.
LOADED = {("script", "src"), ("img", "src"), ("iframe", "src"), ("source", "src"), ("video", "src"), ("audio", "src")}


class Page(HTMLParser):
    """Targets, what is loaded, and anchors of one page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.unseen: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        for name in ("id", "name"):
            if name in given and tag != "meta":
                self.anchors.add(given[name])
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        if tag == "link" and "href" in given:
            (self.links if given.get("rel") in ("prev", "next", "canonical", "edit") else self.loaded).append(given["href"])
        for name in given:
            if (tag, name) in LOADED:
                self.loaded.append(given[name])
        if tag == "img" and not given.get("alt"):
            self.unseen.append(given.get("src", "")[:60])


def read(path: pathlib.Path) -> Page:
    page = Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def mistakes(folder: pathlib.Path) -> list[str]:
    """A line for each thing that is wrong."""
    pages = {path.resolve(): read(path) for path in sorted(folder.rglob("*.html"))}
    if not pages:
        return [f"{folder}: no page"]
    wrong = []
    for path, page in pages.items():
        where = path.relative_to(folder.resolve())
        for link in page.links + page.loaded:
            target = urllib.parse.urlsplit(link)
            if target.scheme in ("http", "https", "mailto", "data", "javascript") or link.startswith("//"):
                if link in page.loaded and target.scheme != "data":
                    wrong.append(f"{where}: loads {link}")
                continue
            to = (path.parent / urllib.parse.unquote(target.path)).resolve() if target.path else path
            if target.path.startswith("/") and where.name == "404.html":
                to = (folder.resolve() / urllib.parse.unquote(target.path).lstrip("/")).resolve()
            if to.is_dir():
                to = to / "index.html"
            anchor = urllib.parse.unquote(target.fragment)
            if not to.exists():
                wrong.append(f"{where}: no {link}")
            elif anchor and to in pages and anchor not in pages[to].anchors and not anchor.startswith("__"):
                wrong.append(f"{where}: no #{anchor} in {to.name}")
        wrong += [f"{where}: a picture without words: {source}" for source in page.unseen]
    for style in folder.rglob("*.css"):
        for piece in style.read_text(encoding="utf-8").split("url(")[1:]:
            if piece.strip("\"' ").startswith(("http:", "https:", "//")):
                wrong.append(f"{style.relative_to(folder)}: loads {piece.split(')')[0]}")
    return wrong


def main() -> int:
    wrong = mistakes(pathlib.Path(sys.argv[1]))
    print("\n".join(wrong), end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
