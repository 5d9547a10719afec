"""cmsis.py FOLDER GLOBAL COMPONENT...: the sources and include folders that the pack's components name, for a compiler's command line;
what they put before every file goes to GLOBAL.

Ends with an error where a file is not there, or where lib/ or port_q15/ has a source that no component names.
"""
import sys
import xml.etree.ElementTree
from pathlib import Path

folder = Path(sys.argv[1])
tree = xml.etree.ElementTree.parse(next(folder.glob("*.pdsc")))
named, line, before = set(), [], []
for component in tree.iter("component"):
    if component.get("Csub") in sys.argv[3:]:
        before.append(component.findtext("Pre_Include_Global_h", ""))
    for file in component.iter("file"):
        path = folder / file.get("name")
        if not path.exists():
            sys.exit(f"{path}: named, and not there")
        if file.get("category") == "sourceC":
            named.add(path)
        if component.get("Csub") in sys.argv[3:]:
            kind = file.get("category")
            line += [str(path)] if kind == "sourceC" else [f"-I{path}"] if kind == "include" else []
missing = {*folder.glob("lib/*.c"), *folder.glob("port_q15/*.c")} - named
if missing:
    sys.exit(f"no component has {', '.join(map(str, missing))}")
Path(sys.argv[2]).write_text("".join(before))
print(" ".join(line))
