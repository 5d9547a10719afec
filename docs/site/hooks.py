"""What mkdocs does beside its plugins."""

from __future__ import annotations

import re
from typing import Any


PARAMETERS = re.compile(r'(<span class="doc-section-title">Parameters:</span></p>\s*)(<table>.*?</table>)', re.S)


def without_types(table: str) -> str:
    """A table of parameters without its second column: names that share a text would all have the first one's type; the
    signature above has each."""

    def row(match: re.Match[str]) -> str:
        cells = list(re.finditer(r"<t([hd])\b.*?</t\1>", match[0], re.S))
        return match[0][: cells[1].start()] + match[0][cells[1].end() :] if len(cells) > 2 else match[0]

    return re.sub(r"<tr\b.*?</tr>", row, table, flags=re.S)


def on_page_content(html: str, **_: Any) -> str:
    """Roles of another documentation builder in docstrings, as code."""
    html = PARAMETERS.sub(lambda m: m[1] + without_types(m[2]), html)
    html = re.sub(r"<blockquote>\s*(<blockquote>\s*)+", "<blockquote>", html)
    html = re.sub(r"</blockquote>\s*(</blockquote>\s*)+", "</blockquote>", html)
    return re.sub(r":(?:func|class|meth|mod|attr):(?=<code>)", "", html)
