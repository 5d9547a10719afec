#!/usr/bin/env python3
"""Mutants of lib/ or port_q15/: one operator, constant, condition or statement is changed, and the tests in C that concern the library must fail.

mutants.py FOLDER [--count N] [--seed S] [--build build] [--jobs N] prints each survivor and, last, how many of the sample the tests kill.
Changes that the compiler sees no difference in are no mutants. Those that nobody can see are in equivalent.txt, each with its reason.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
TOP = HERE.parent.parent
CFLAGS = ["-std=c99", "-O2", "-ffp-contract=off", "-w", "-Ilib", "-Iport_q15"]
LINK = ["-lsundials_cvode", "-lsundials_nvecserial", "-lsundials_sunmatrixdense", "-lsundials_sunlinsoldense", "-lsundials_sunnonlinsolfixedpoint", "-lm"]
# Slow starts and other programs: what they find, others find.
LEFT_OUT = {"test_api_warnings", "test_fast_math", "test_size"}


@dataclass(frozen=True)
class Mutant:
    file: str
    line: int
    before: str
    after: str
    what: str


@dataclass
class Outcome:
    mutant: Mutant
    verdict: str  # "killed", "same", "invalid", "survived", "equivalent"
    by: str = ""


def code_of(text: str) -> list[str]:
    """Lines without comments, strings and what the preprocessor reads; same columns."""

    def blank(m: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", m.group(0))

    text = re.sub(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'", blank, text, flags=re.S)
    return ["" if line.lstrip().startswith("#") else line for line in text.split("\n")]


SWAPS = {
    " + ": " - ",
    " - ": " + ",
    " * ": " / ",
    " / ": " * ",
    " < ": " <= ",
    " <= ": " < ",
    " > ": " >= ",
    " >= ": " > ",
    " == ": " != ",
    " != ": " == ",
    " && ": " || ",
    " || ": " && ",
    " += ": " -= ",
    " -= ": " += ",
    " << ": " >> ",
    " >> ": " << ",
    " & ": " | ",
    " | ": " & ",
    "++": "--",
}


def of_line(code: str) -> list[tuple[str, str]]:
    """What can be done to a line: its new text, and a word for it."""
    out: list[tuple[str, str]] = []
    for old, new in SWAPS.items():
        for m in re.finditer(re.escape(old), code):
            out.append((code[: m.start()] + new + code[m.end() :], f"{old.strip()} to {new.strip()}"))
    for m in re.finditer(r"(?<![\w.])(\d+)(u?)(?![\w.])", code):
        n = int(m.group(1))
        out.append((code[: m.start()] + str(n + 1) + m.group(2) + code[m.end() :], f"{n} to {n + 1}"))
        if n > 0:
            out.append((code[: m.start()] + str(n - 1) + m.group(2) + code[m.end() :], f"{n} to {n - 1}"))
    for m in re.finditer(r"(?<![\w.])(\d+\.\d+(?:e-?\d+)?)f", code):
        x = float(m.group(1))
        out.append((code[: m.start()] + repr(1.25 * x if x else 1.0) + "f" + code[m.end() :], f"{m.group(1)} by 1.25"))
    m = re.search(r"\bif \((.*)\)", code)
    if m:
        out.append((code[: m.start(1)] + "!(" + m.group(1) + ")" + code[m.end(1) :], "condition turned"))
        out.append((code[: m.start(1)] + "0" + code[m.end(1) :], "condition never"))
    if re.match(r"^ {4,}(?!return|break|continue|case|default|const |static |typedef |enum |struct |goto)[\w*>\[\].\-]+.*[=(].*;$", code) and not re.match(
        r"^\s+(?:dqw_\w+|float|u?int\d*_t|int|bool|volatile|double|size_t|unsigned)\b[ *]+\w+", code
    ):
        out.append((re.match(r"^\s*", code).group(0) + ";", "removed"))  # type: ignore[union-attr]
    return out


def candidates(folder: str) -> list[Mutant]:
    all_of: list[Mutant] = []
    for path in sorted((TOP / folder).glob("*.[ch]")):
        text = path.read_text()
        lines = text.split("\n")
        inside = path.suffix == ".c"
        for number, code in enumerate(code_of(text)):
            if path.suffix == ".h":
                if re.match(r"^static inline", code):
                    inside = True
                elif code == "}":
                    inside = False
            if not inside or not code.strip():
                continue
            for after, what in of_line(code.rstrip()):
                all_of.append(Mutant(f"{folder}/{path.name}", number + 1, lines[number], after, what))
    return all_of


def sample(folder: str, count: int, seed: int) -> list[Mutant]:
    """By lines, so that a line with many operators counts no more than another."""
    by_line: dict[tuple[str, int], list[Mutant]] = {}
    for m in candidates(folder):
        by_line.setdefault((m.file, m.line), []).append(m)
    draw = random.Random(seed)
    keys = sorted(by_line)
    draw.shuffle(keys)
    return [draw.choice(by_line[k]) for k in keys[:count]]


def equivalents() -> set[tuple[str, str, str]]:
    """Of equivalent.txt: file, line without its blanks, what was done. A reason follows behind the third bar."""
    out = set()
    for line in (HERE / "equivalent.txt").read_text().split("\n"):
        if line and not line.startswith("#"):
            file, code, what, reason = (part.strip() for part in line.split(" | ", 3))
            if not reason:
                sys.exit(f"equivalent.txt: no reason: {line}")
            out.add((file, code, what))
    return out


class Bench:
    """Everything built once; a mutant is one object anew."""

    def __init__(self, build: Path, folder: str) -> None:
        self.build, self.folder = build, folder
        room = {"lib": "lib", "port_q15": "port_q15"}[folder]
        self.tests = sorted(p.stem for p in (TOP / "tests" / room).glob("test_*.c") if p.stem not in LEFT_OUT)
        if folder == "lib":
            # The twins of the fixed-point port run the float side beside it.
            self.tests += ["test_twin_estimator", "test_twin_monitor", "test_twin_shaft", "test_twin_effect"]
        self.seconds: dict[str, float] = {}
        for test in self.tests:
            began = time.monotonic()
            if self.run(build / "tests" / test, 600.0) != 0:
                sys.exit(f"{test} fails before anything is changed")
            self.seconds[test] = time.monotonic() - began

    def run(self, program: Path, limit_s: float) -> int:
        env = dict(os.environ, DQW_TEST_KIND="plain", BUILD=str(self.build))
        try:
            return subprocess.run([str(program)], cwd=TOP, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=limit_s).returncode
        except subprocess.TimeoutExpired:
            return -1

    def order(self, mutant: Mutant) -> list[str]:
        """Those of the file's name first, then the quick ones."""
        words = set(re.sub(r"^dqw_|_q15$", "", Path(mutant.file).stem).split("_"))
        return sorted(self.tests, key=lambda t: (-len(words & set(t.split("_"))), self.seconds[t]))

    def judge(self, mutant: Mutant) -> Outcome:
        with tempfile.TemporaryDirectory() as name:
            tmp = Path(name)
            for part in ("lib", "port_q15"):
                shutil.copytree(TOP / part, tmp / part)
            path = tmp / mutant.file
            lines = path.read_text().split("\n")
            lines[mutant.line - 1] = mutant.after
            path.write_text("\n".join(lines))
            # A header is in every file.
            files = [mutant.file] if mutant.file.endswith(".c") else [f"{p}/{f.name}" for p in ("lib", "port_q15") for f in (TOP / p).glob("*.c")]
            archives = {}
            for part in ("libdqw", "libdqw_q15"):
                archives[part] = tmp / f"{part}.a"
                shutil.copy(self.build / f"{part}.a", archives[part])
            same = True
            for file in files:
                made = tmp / (Path(file).stem + ".o")
                if subprocess.run(["cc", *CFLAGS, "-c", file, "-o", str(made)], cwd=tmp, capture_output=True).returncode != 0:
                    return Outcome(mutant, "invalid")
                was = tmp / "was.o"
                subprocess.run(["cc", *CFLAGS, "-c", file, "-o", str(was)], cwd=TOP, check=True)
                if made.read_bytes() != was.read_bytes():
                    same = False
                    subprocess.run(["ar", "r", str(archives["libdqw" if file.startswith("lib/") else "libdqw_q15"]), str(made)], check=True, capture_output=True)
            if same:
                return Outcome(mutant, "same")
            for test in self.order(mutant):
                program = tmp / test
                objects = [self.build / "tests" / f"{test}.o", self.build / "tests/unity.o", self.build / "libsim.a", archives["libdqw_q15"], archives["libdqw"]]
                subprocess.run(["cc", *map(str, objects), *LINK, "-o", str(program)], check=True, capture_output=True)
                if self.run(program, 5.0 + 5.0 * self.seconds[test]) != 0:
                    return Outcome(mutant, "killed", test)
                program.unlink()
        return Outcome(mutant, "survived")


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", choices=["lib", "port_q15"])
    arguments.add_argument("--count", type=int, default=300)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--build", type=Path, default=TOP / "build")
    arguments.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    o = arguments.parse_args()
    known = equivalents()
    bench = Bench(o.build.resolve(), o.folder)
    count = {verdict: 0 for verdict in ("killed", "survived", "equivalent", "same", "invalid")}
    with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        for outcome in pool.map(bench.judge, sample(o.folder, o.count, o.seed)):
            m = outcome.mutant
            if outcome.verdict == "survived" and (m.file, m.before.strip(), m.what) in known:
                outcome.verdict = "equivalent"
            count[outcome.verdict] += 1
            if outcome.verdict == "survived":
                print(f"{m.file}:{m.line}: {m.what}: {m.before.strip()}", flush=True)
    valid = count["killed"] + count["survived"]
    print(f"{o.folder}: {count['killed']} of {valid} killed, {100.0 * count['killed'] / max(valid, 1):.1f} %; {count['equivalent']} equivalent, "
          f"{count['same']} the same to the compiler, {count['invalid']} that do not compile")
    return 0


if __name__ == "__main__":
    sys.exit(main())
