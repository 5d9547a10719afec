"""What mkdocs does beside its plugins."""

from __future__ import annotations

import re
from typing import Any


def on_page_content(html: str, **_: Any) -> str:
    """Roles of another documentation builder in docstrings, as code."""
    html = re.sub(r"<blockquote>\s*(<blockquote>\s*)+", "<blockquote>", html)
    html = re.sub(r"</blockquote>\s*(</blockquote>\s*)+", "</blockquote>", html)
    return re.sub(r":(?:func|class|meth|mod|attr):(?=<code>)", "", html)
