#!/usr/bin/env python3
"""The notebooks, which stand in docs/notebooks as text, run anew and written as pages with their pictures.

usage: notebooks.py FOLDER [NAME ...]     FOLDER/NAME.md and FOLDER/NAME_files; all notebooks where none is named
"""

from __future__ import annotations

import pathlib
import re
import sys
import tempfile

import jupytext
from nbclient import NotebookClient
from nbconvert import MarkdownExporter

NOTEBOOKS = pathlib.Path(__file__).resolve().parents[1] / "notebooks"


def page(source: pathlib.Path, folder: pathlib.Path) -> None:
    """Run one notebook in an empty folder of its own; an exception in a cell ends it."""
    notebook = jupytext.read(source)
    with tempfile.TemporaryDirectory() as place:
        # Its warning that others on this machine could listen is not one about the notebook.
        client = NotebookClient(notebook, timeout=1800, kernel_name="python3", resources={"metadata": {"path": place}},
                                extra_arguments=["--log-level=ERROR"])
        client.execute()
    text, resources = MarkdownExporter().from_notebook_node(notebook, {"output_files_dir": f"{source.stem}_files"})
    title = re.search(r"^# (.*)", text, re.M)
    heading = title[1] if title else source.stem
    pictures = iter(range(1, 1000))
    text = re.sub(r"!\[png\]\(([^)]*)\)", lambda m: f"![{heading}, picture {next(pictures)}]({m[1]}){{.plot}}", text)
    # What a notebook's style sheet is for, and frames' own borders: the page has its own.
    text = re.sub(r"<style scoped>.*?</style>", "", text, flags=re.S)
    text = text.replace(' border="1" class="dataframe"', "").replace(' style="text-align: right;"', "")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{source.stem}.md").write_text(text)
    for name, picture in resources["outputs"].items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(picture)


def main() -> int:
    if len(sys.argv) < 2:
        print(__doc__)
        return 2
    wanted = sys.argv[2:] or sorted(path.stem for path in NOTEBOOKS.glob("*.py"))
    for name in wanted:
        page(NOTEBOOKS / f"{name}.py", pathlib.Path(sys.argv[1]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
