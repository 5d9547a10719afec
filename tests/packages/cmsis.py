"""cmsis.py FOLDER COMPONENT...: the sources and include folders that the pack's components name, for a compiler's command line.

Ends with an error where a file is not there, or where lib/ or port_q15/ has a source that no component names.
"""
import sys
import xml.etree.ElementTree
from pathlib import Path

folder = Path(sys.argv[1])
tree = xml.etree.ElementTree.parse(next(folder.glob("*.pdsc")))
named, line = set(), []
for component in tree.iter("component"):
    for file in component.iter("file"):
        path = folder / file.get("name")
        if not path.exists():
            sys.exit(f"{path}: named, and not there")
        if file.get("category") == "sourceC":
            named.add(path)
        if component.get("Csub") in sys.argv[2:]:
            kind = file.get("category")
            line += [str(path)] if kind == "sourceC" else [f"-I{path}"] if kind == "include" else []
missing = {*folder.glob("lib/*.c"), *folder.glob("port_q15/*.c")} - named
if missing:
    sys.exit(f"no component has {', '.join(map(str, missing))}")
print(" ".join(line))
