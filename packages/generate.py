#!/usr/bin/env python3
"""generate.py OUT [KIND...]: makes each kind of package from packages/KIND, packages/facts.toml and the tree, into OUT/KIND.

A file that ends in .in is a template: @KEY@ is a fact, in the form that its kind wants. What a kind needs beside its own files
stands in KINDS. No package holds a list that a human keeps.
"""
import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from datetime import datetime, timezone
from email.utils import format_datetime
from pathlib import Path
from xml.sax.saxutils import escape

ROOT = Path(__file__).resolve().parent.parent


def facts():
    with open(ROOT / "packages/facts.toml", "rb") as file:
        known = tomllib.load(file)
    known["version"] = re.search(r'DQW_VERSION "(.*)"', (ROOT / "lib/dqw_version.h").read_text())[1]
    known["effect_weights"] = re.search(r"define DQW_EFFECT_WEIGHTS (\d+)", (ROOT / "lib/dqw_size.h").read_text())[1]
    return known


def sources(known):
    """What each arithmetic compiles: its own files alone, and those that both have."""
    shared = ["lib/" + name for name in known["shared"]]
    own = sorted(str(p.relative_to(ROOT)) for p in (ROOT / "lib").glob("*.c"))
    return {
        "shared": shared,
        "float": [name for name in own if name not in shared],
        "q15": sorted(str(p.relative_to(ROOT)) for p in (ROOT / "port_q15").glob("*.c")),
    }


def values(known, kind):
    """Every @KEY@ as text."""
    files = sources(known)
    text = {key.upper(): value for key, value in known.items() if isinstance(value, str)}
    text["SENTENCE"] = known["summary"] + "."
    if kind == "platformio":
        text["KEYWORDS"] = json.dumps(known["keywords"])
        text["FLAGS"] = json.dumps(known["float_flags"] + known["own_flags"])
    elif kind == "cmsis":
        text = {key: escape(value) for key, value in text.items()}
        text["FLOAT_FLAGS"] = ", ".join(f'"{flag}"' for flag in known["float_flags"])
        text["KEYWORDS"] = "".join(f"\n    <keyword>{escape(word)}</keyword>" for word in known["keywords"])
        for part, names in files.items():
            text[part.upper()] = "".join(f'\n        <file category="sourceC" name="{name}"/>' for name in names)
    elif kind == "meson":
        for part, names in files.items():
            text[part.upper()] = ", ".join(f"'{name}'" for name in names)
        text["FLOAT_FLAGS"] = ", ".join(f"'{flag}'" for flag in known["float_flags"])
        text["OWN_FLAGS"] = ", ".join(f"'{flag}'" for flag in known["own_flags"])
    else:
        text["SHARED"] = " ".join(known["shared"])
        text["KEYWORDS"] = ", ".join(f'"{word}"' for word in known["keywords"])
        text["FLOAT_FLAGS"] = " ".join(known["float_flags"])
        text["OWN_FLAGS"] = " ".join(known["own_flags"])
        day = datetime.fromisoformat(known["date"]).replace(tzinfo=timezone.utc)
        text["DATE_RFC"] = format_datetime(day)
        installed = re.search(r'^build="(.*)"', (ROOT / ".ci/install").read_text(), re.M)[1].split()
        # What every builder of Debian has, and what only runs.
        needed = sorted(set(installed) - {"g++", "make", "gnuplot-nox"})
        text["BUILD_DEPENDS"] = ",\n               ".join(needed)
        terms = (ROOT / "LICENSE").read_text().split("\n\n", 2)[2].rstrip().split("\n")
        text["LICENCE_TEXT"] = "\n".join(" " + (line or ".") for line in terms)
        text["WEIGHTS"] = ", ".join(str(n) for n in range(25))
    return text


def fill(template, text):
    return re.sub(r"@([A-Z][A-Z_0-9]*)@", lambda found: text[found[1]], template)


def copy(name, to):
    to.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(ROOT / name, to)


def tree(out):
    """lib/ and port_q15/ side by side."""
    for folder in ("lib", "port_q15"):
        for path in sorted((ROOT / folder).glob("*.[ch]")):
            copy(path, out / folder / path.name)


def everything(out):
    """All that is tracked."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True)
    if listed.returncode == 0:
        names = [name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]
    else:
        names = [str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if p.is_file() and p.relative_to(ROOT).parts[0] != "build"]
    for name in names:
        copy(name, out / name)


def flat(out):
    """Both in one folder, as builders want them that look into src/ alone."""
    for folder in ("lib", "port_q15"):
        for path in sorted((ROOT / folder).glob("*.[ch]")):
            copy(path, out / "src" / path.name)


def consumer(out, *names):
    for name in names:
        copy("packages/consumer/" + name, out / name)


def finish_arduino(out, known):
    consumer(out / "examples/LearnMotor", "learn.c", "learn.h", "motor.h")


def finish_conan(out, known):
    """What CMakeLists.txt reads."""
    copy("CMakeLists.txt", out / "CMakeLists.txt")
    for name in ("facts.toml", "dqwatch-config.cmake.in", "dqwatch-config-version.cmake.in"):
        copy("packages/" + name, out / "packages" / name)
    consumer(out / "test_package", "learn.c", "learn_q15.c", "learn.h", "motor.h", "main.c")


def finish_platformio(out, known):
    consumer(out / "examples/learn", "learn.c", "learn.h", "motor.h", "main.c")


def finish_cmsis(out, known):
    """The pack itself, beside its content."""
    name = f"{known['name']}.{known['name']}.{known['version']}.pack"
    with zipfile.ZipFile(out.parent / name, "w", zipfile.ZIP_DEFLATED) as pack:
        for path in sorted(out.rglob("*")):
            if path.is_file():
                pack.write(path, path.relative_to(out))


# The layout of the sources, and what remains to be done.
KINDS = {
    "platformio": (flat, finish_platformio),
    "arduino": (flat, finish_arduino),
    "zephyr": (tree, None),
    "espidf": (tree, None),
    "cmsis": (tree, finish_cmsis),
    "meson": (tree, None),
    "conan": (tree, finish_conan),
    "debian": (everything, None),
}


def make(kind, out, known):
    lay, finish = KINDS[kind]
    shutil.rmtree(out, ignore_errors=True)
    lay(out)
    copy("LICENSE", out / "LICENSE")
    text = values(known, kind)
    for path in sorted((ROOT / "packages" / kind).rglob("*")):
        if not path.is_file() or path.name == ".clang-format":
            continue
        to = out / fill(str(path.relative_to(ROOT / "packages" / kind)), text)
        if path.suffix != ".in":
            copy(path, to)
            continue
        to.parent.mkdir(parents=True, exist_ok=True)
        to.with_suffix("").write_text(fill(path.read_text(), text))
    if finish:
        finish(out, known)


def main():
    if len(sys.argv) < 2 or any(kind not in KINDS for kind in sys.argv[2:]):
        sys.exit(f"generate.py OUT [KIND...], of {', '.join(KINDS)}")
    known = facts()
    for kind in sys.argv[2:] or KINDS:
        make(kind, Path(sys.argv[1]) / kind, known)


if __name__ == "__main__":
    main()
