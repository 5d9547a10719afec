#!/usr/bin/env python3
"""Mutants of lib/ or port_q15/: one operator, constant, condition or statement is changed, and the tests in C that concern the library must fail.

mutants.py FOLDER [--count N] [--seed S] [--build build] [--jobs N] prints each survivor and, last, how many of the sample the tests kill.
mutants.py FOLDER --only FILE:LINE prints the verdict on every mutant of that line. What is judged stays in build/mutants.tsv: a campaign that was
interrupted goes on.
Changes that the compiler sees no difference in are no mutants, nor is < to <= where the larger, the smaller or the size is taken,
nor x < 1 for x < 0 in the size of a whole number, nor an array with an element to spare. Those that nobody can see are in equivalent.txt, each with its reason.
"""

from __future__ import annotations

import argparse
import atexit
import collections
import concurrent.futures
import hashlib
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
TOP = HERE.parent.parent
CFLAGS = ["-std=c99", "-O2", "-ffp-contract=off", "-w", "-Ilib", "-Iport_q15"]
LINK = ["-lsundials_cvode", "-lsundials_nvecserial", "-lsundials_sunmatrixdense", "-lsundials_sunlinsoldense", "-lsundials_sunnonlinsolfixedpoint", "-lm"]
PARTS = ["lib", "port_q15"]
ARCHIVES = ["libdqw.a", "libdqw_q15.a"]
# As the Makefile has them; of the changed files alone.
SANITIZERS = ["-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"]
# What reads or writes beyond a field does so in a short test as in a long one.
SANITIZED_S = 2.0
# What a longer test does not run of the library it need not judge.
COVERED_S = 0.5
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


def closing(code: str, at: int) -> int:
    """Where the parenthesis that is open at `at` is closed; -1 where another line does."""
    depth = 1
    for n in range(at, len(code)):
        depth += {"(": 1, ")": -1}.get(code[n], 0)
        if depth == 0:
            return n
    return -1


# A whole operand, and what may not follow the last one.
VALUE = r"(?<![+\-*/%|] )(?<![^&]& )(?<![\w.\])>-])-?[\w.\[\]]+(?:->[\w.\[\]]+)*"
ENDS = r"(?![\w.\[(-]| [+\-*/%&|=?])"
CAST = r"(?:\(\w+\))?"
# a < b ? a : b, a < 0 ? -a : a, if (a < b) a = b: at equality both ways give the same.
CHOICES = [
    re.compile(rf"(?P<a>{VALUE}) [<>] (?P<b>-?[\w.\[\]>-]+)(?= \? {CAST}(?:(?P=a) : {CAST}(?P=b)|(?P=b) : {CAST}(?P=a)){ENDS})"),
    re.compile(rf"(?P<a>{VALUE}) [<>] 0(?:\.0f)?(?= \? (?:-(?P=a) : (?:(?P=a)|0(?:\.0f)?)|(?P=a) : -(?P=a)){ENDS})"),
    re.compile(r"\bif \((?P<a>[\w.\[\]>-]+) [<>] (?P<b>[\w.\[\]>-]+)\)(?= (?:(?P=a) = (?P=b)|(?P=b) = (?P=a));)"),
]


def is_choice(code: str, at: int) -> bool:
    return any(m.start() <= at < m.end() for c in CHOICES for m in c.finditer(code))


# Of a whole number x < 1 ? -x : x is its size too.
SIZE = re.compile(r"(?P<a>[\w.\[\]>-]+) < (?P<nought>0) \? -(?P=a) : (?P=a)" + ENDS)


def is_of_size(code: str, at: int) -> bool:
    return any(m.start("nought") == at for m in SIZE.finditer(code))


# x_q24 = 0, x_q24[3] = {0}, |x_q24| of one last place: NN bits behind the point, where they are enough for a last place
# to say nothing.
FIXED = re.compile(r"\w_q(?P<bits>\d+)(?:\[[^\]]*\])*(?: = \w_q\d+)* = \{?(?P<number>[01])(?![\w.])")


# T x[3]: an element more is one that nothing reads; as a parameter it is a pointer, whatever stands there.
DECLARED = re.compile(r"\b(?!return\b|case\b|else\b)[A-Za-z]\w*\*? \*?[A-Za-z]\w*(?:\[\w+\])*\[$")


def is_size(code: str, at: int, end: int) -> bool:
    return code[end : end + 1] == "]" and DECLARED.search(code[:at]) is not None


def is_parameter(code: str, at: int) -> bool:
    return code[:at].count("(") > code[:at].count(")")


def in_fixed_point(code: str, at: int, n: int) -> str:
    """A number in fixed point is changed as one in float is: by a quarter, 0 to half a unit. A last place is no change that a test should see."""
    if n >= 4096:
        return str(n + n // 4 if n + n // 4 < 2**31 else n - n // 4)
    for m in FIXED.finditer(code):
        bits = int(m.group("bits"))
        if m.start("number") == at and bits >= 15:
            return f"((int64_t)1 << {bits - 1})" if bits > 31 else str(1 << (bits - 1))
    return ""


def of_line(code: str) -> list[tuple[str, str]]:
    """What can be done to a line: its new text, and a word for it."""
    out: list[tuple[str, str]] = []
    for old, new in SWAPS.items():
        for m in re.finditer(re.escape(old), code):
            if old in (" < ", " > ") and is_choice(code, m.start()):
                continue
            out.append((code[: m.start()] + new + code[m.end() :], f"{old.strip()} to {new.strip()}"))
    for m in re.finditer(r"(?<![\w.])(\d+)(u?)(?![\w.])", code):
        n = int(m.group(1))
        sizes = is_size(code, m.start(), m.end())
        if is_of_size(code, m.start()) or (sizes and is_parameter(code, m.start())):
            continue
        q = in_fixed_point(code, m.start(), n)
        if q:
            out.append((code[: m.start()] + q + code[m.end() :], f"{n} to {q}"))
            continue
        if not sizes:
            out.append((code[: m.start()] + str(n + 1) + m.group(2) + code[m.end() :], f"{n} to {n + 1}"))
        if n > 0:
            out.append((code[: m.start()] + str(n - 1) + m.group(2) + code[m.end() :], f"{n} to {n - 1}"))
    for m in re.finditer(r"(?<![\w.])(\d+\.\d+(?:e-?\d+)?)f", code):
        x = float(m.group(1))
        out.append((code[: m.start()] + repr(1.25 * x if x else 1.0) + "f" + code[m.end() :], f"{m.group(1)} by 1.25"))
    m = re.search(r"\bif \(", code)
    end = closing(code, m.end()) if m else -1
    if m and end >= 0:
        out.append((code[: m.end()] + "!(" + code[m.end() : end] + ")" + code[end:], "condition turned"))
        out.append((code[: m.end()] + "0" + code[end:], "condition never"))
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


def of_lines(folder: str, places: list[str]) -> list[Mutant]:
    """Every mutant of FILE, FILE:LINE or FILE:FIRST-LAST."""

    def holds(place: str, m: Mutant) -> bool:
        file, _, lines = place.partition(":")
        first, _, last = lines.partition("-")
        return m.file == file and (not lines or int(first) <= m.line <= int(last or first))

    return [m for m in candidates(folder) if any(holds(place, m) for place in places)]


def equivalents() -> set[tuple[str, str, str]]:
    """Of equivalent.txt: file, line without its blanks, what was done. A reason follows behind the third bar."""
    out = set()
    for line in (HERE / "equivalent.txt").read_text().split("\n"):
        if line and not line.startswith("#"):
            file, code, what, reason = (part.strip() for part in line.split(" | ", 3))
            if not reason:
                sys.exit(f"equivalent.txt: no reason: {line}")
            if code not in map(str.strip, (TOP / file).read_text().split("\n")):
                sys.exit(f"equivalent.txt: {file} has no such line any more: {code}")
            out.add((file, code, what))
    return out


class Memory:
    """What is judged already, so that an interrupted campaign goes on: a verdict holds as long as the sources and the tests that gave it."""

    def __init__(self, path: Path) -> None:
        self.path, self.lock = path, threading.Lock()
        self.verdicts: dict[str, tuple[str, str]] = {}
        self.kills: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
        if path.exists():
            for line in path.read_text().split("\n"):
                if line:
                    self.take(*line.split("\t"))

    def take(self, key: str, verdict: str, by: str, file: str) -> None:
        self.verdicts[key] = (verdict, by)
        if verdict == "killed":
            self.kills[file][by] += 1

    def add(self, key: str, verdict: str, by: str, file: str) -> None:
        with self.lock:
            self.take(key, verdict, by, file)
            with self.path.open("a") as out:
                out.write("\t".join((key, verdict, by, file)) + "\n")


def digest(*parts: bytes) -> str:
    h = hashlib.sha256()
    for part in parts:
        h.update(hashlib.sha256(part).digest())
    return h.hexdigest()[:24]


class Bench:
    """Everything built once; a mutant is one object anew."""

    def __init__(self, build: Path, folder: str, jobs: int, sanitized: bool, known: set[tuple[str, str, str]]) -> None:
        self.build, self.sanitized, self.known = build, sanitized, known
        self.tests = sorted(p.stem for p in (TOP / "tests" / folder).glob("test_*.c") if p.stem not in LEFT_OUT)
        if folder == "lib":
            # The twins of the fixed-point port run the float side beside it.
            self.tests += sorted(p.stem for p in (TOP / "tests/port_q15").glob("test_twin_*.c"))
        self.sources = digest(*(p.read_bytes() for part in PARTS for p in sorted((TOP / part).glob("*.[ch]"))))
        self.memory = Memory(build / "mutants.tsv")
        self.was = Path(tempfile.mkdtemp(dir=build, prefix="mutants."))
        atexit.register(shutil.rmtree, self.was)
        self.files = [f"{part}/{p.name}" for part in PARTS for p in sorted((TOP / part).glob("*.c"))]
        for file in self.files:
            subprocess.run(["cc", *CFLAGS, "-c", file, "-o", str(self.object(self.was, file))], cwd=TOP, check=True)
        for archive in ARCHIVES:
            members = [str(self.object(self.was, f)) for f in self.files if self.archive(f) == archive]
            subprocess.run(["ar", "rcs", str(self.was / archive), *members], check=True)
        self.links: dict[str, set[str]] = {}
        self.digests = {t: digest((build / "tests" / f"{t}.o").read_bytes()) for t in self.tests}
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            self.seconds = dict(zip(self.tests, pool.map(self.before, self.tests)))
            slow = [t for t in self.tests if self.seconds[t] > COVERED_S]
            self.lines = dict(zip(slow, pool.map(self.covered, slow)))

    def covered(self, test: str) -> dict[str, dict[int, bool]]:
        """Of each file, which lines with code the test runs; a line without an entry has none, by gcov's account."""
        kept = self.build / "mutants.lines" / f"{digest(self.sources.encode(), self.digests[test].encode())}.json"
        if not kept.exists():
            folder = self.was / "coverage" / test
            folder.mkdir(parents=True)
            objects = [str(folder / (Path(f).stem + ".o")) for f in self.files]
            for file, made in zip(self.files, objects):
                subprocess.run(["cc", *CFLAGS, "-O1", "--coverage", "-c", str(TOP / file), "-o", made], cwd=TOP, check=True)
            fixed = [str(self.build / "tests" / f"{test}.o"), str(self.build / "tests/unity.o"), str(self.build / "libsim.a")]
            subprocess.run(["cc", "--coverage", *fixed[:2], *objects, fixed[2], *LINK, "-o", str(folder / test)], check=True)
            env = dict(os.environ, DQW_TEST_KIND="plain", BUILD=str(self.build))
            subprocess.run([str(folder / test)], cwd=TOP, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            runs: dict[str, dict[int, bool]] = {}
            for part in PARTS:
                counts = [str(p) for p in folder.glob("*.gcda") if (TOP / part / f"{p.stem}.c").exists()]
                out = subprocess.run(["gcov", "-j", "-t", *counts], cwd=folder, capture_output=True, text=True).stdout
                for unit in filter(None, out.split("\n")):
                    for file in json.loads(unit)["files"]:
                        name = os.path.relpath(os.path.join(TOP, file["file"]), TOP)
                        of = runs.setdefault(name, {})
                        for line in file["lines"]:
                            of[line["line_number"]] = of.get(line["line_number"], False) or line["count"] > 0
            kept.parent.mkdir(exist_ok=True)
            kept.write_text(json.dumps(runs))
            shutil.rmtree(folder)
        return {file: {int(n): ran for n, ran in of.items()} for file, of in json.loads(kept.read_text()).items()}

    def runs(self, test: str, mutant: Mutant) -> bool:
        """A table, a header's constant or a line that goes on above has no count of its own: then every test may."""
        return self.lines.get(test, {}).get(mutant.file, {}).get(mutant.line, True)

    def before(self, test: str) -> float:
        """How long a test takes, and what it links, before anything is changed."""
        program = self.was / test
        linked = self.link(test, self.was, program, [])
        self.links[test] = {f for f in self.files if f"){self.object(Path(), f)}" in linked}
        key = digest(self.sources.encode(), self.digests[test].encode())
        verdict, seconds = self.memory.verdicts.get(key, ("", ""))
        if verdict != "passes":
            began = time.monotonic()
            if not self.passes(program, 600.0):
                sys.exit(f"{test} fails before anything is changed")
            seconds = f"{time.monotonic() - began:.2f}"
            self.memory.add(key, "passes", seconds, test)
        return float(seconds)

    @staticmethod
    def archive(file: str) -> str:
        return ARCHIVES[PARTS.index(file.split("/")[0])]

    @staticmethod
    def object(folder: Path, file: str) -> Path:
        return folder / (Path(file).stem + ".o")

    def link(self, test: str, folder: Path, program: Path, flags: list[str], compiled: Path | None = None) -> str:
        objects = [compiled or self.build / "tests" / f"{test}.o", self.build / "tests/unity.o", self.build / "libsim.a", *(folder / a for a in reversed(ARCHIVES))]
        return subprocess.run(["cc", *flags, *map(str, objects), *LINK, "-Wl,-t,-t", "-o", str(program)], check=True, capture_output=True, text=True).stdout

    def passes(self, program: Path, limit_s: float, kind: str = "plain") -> bool:
        """Until the first line that says FAIL."""
        # stdbuf preloads a library, which AddressSanitizer would refuse, and every mutant would count as killed.
        env = dict(os.environ, DQW_TEST_KIND=kind, BUILD=str(self.build), ASAN_OPTIONS="verify_asan_link_order=0")
        run = subprocess.Popen(["stdbuf", "-oL", str(program)], cwd=TOP, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        timer = threading.Timer(limit_s, run.kill)
        timer.start()
        assert run.stdout is not None
        for line in run.stdout:
            if b":FAIL" in line:
                run.kill()
        timer.cancel()
        return run.wait() == 0

    def order(self, file: str) -> list[str]:
        """Those that link the file: what kills soonest, by its name and by what it has killed."""
        words = set(re.sub(r"^dqw_|_q15$", "", Path(file).stem).split("_"))

        def rate(test: str) -> float:
            likely = 0.3 + 3.0 * len(words & set(test.split("_"))) + self.memory.kills[file][test]
            return likely / (0.1 + self.seconds[test])

        return sorted((t for t in self.tests if file.endswith(".h") or file in self.links[t]), key=rate, reverse=True)

    def verdict(self, mutant: Mutant) -> Outcome:
        """What has a reason to be equivalent is not run: it would pass every test, which takes longest."""
        if (mutant.file, mutant.before.strip(), mutant.what) in self.known:
            return Outcome(mutant, "equivalent")
        return self.judge(mutant)

    def judge(self, mutant: Mutant) -> Outcome:
        key = digest(self.sources.encode(), f"{mutant.file}:{mutant.line}".encode(), mutant.after.encode())
        tests = [t for t in self.order(mutant.file) if mutant.file.endswith(".h") or self.runs(t, mutant)]
        every = digest(str(self.sanitized).encode(), *(self.digests[t].encode() for t in sorted(tests)))
        verdict, by = self.memory.verdicts.get(key, ("", ""))
        if verdict in ("same", "invalid") or (verdict == "survived" and by == every):
            return Outcome(mutant, verdict)
        if verdict == "killed":
            test, killer = by.split(" ")
            if self.digests.get(test) == killer:
                return Outcome(mutant, verdict, test)
            tests.sort(key=lambda t: t != test)
        outcome = self.judge_anew(mutant, tests)
        by = f"{outcome.by} {self.digests[outcome.by]}" if outcome.by else every
        self.memory.add(key, outcome.verdict, by, mutant.file)
        return outcome

    def judge_anew(self, mutant: Mutant, tests: list[str]) -> Outcome:
        with tempfile.TemporaryDirectory() as name:
            tmp = Path(name)
            for part in PARTS:
                shutil.copytree(TOP / part, tmp / part)
            path = tmp / mutant.file
            lines = path.read_text().split("\n")
            lines[mutant.line - 1] = mutant.after
            path.write_text("\n".join(lines))
            # A header is in every file.
            files = [mutant.file] if mutant.file.endswith(".c") else self.files
            if not all(self.compiles(tmp, file, []) for file in files):
                return Outcome(mutant, "invalid")
            files = [f for f in files if self.object(tmp, f).read_bytes() != self.object(self.was, f).read_bytes()]
            if not files and mutant.file.endswith(".c"):
                return Outcome(mutant, "same")
            by = self.killer(tmp, mutant.file, files, tests, [])
            if not by and self.sanitized and all([self.compiles(tmp, file, SANITIZERS) for file in files]):
                short = [t for t in tests if self.seconds[t] <= SANITIZED_S]
                by = self.killer(tmp, mutant.file, files, short, SANITIZERS)
        return Outcome(mutant, "killed" if by else "survived", by)

    def compiles(self, tmp: Path, file: str, flags: list[str]) -> bool:
        return subprocess.run(["cc", *CFLAGS, *flags, "-c", file, "-o", str(self.object(tmp, file))], cwd=tmp, capture_output=True).returncode == 0

    def test_object(self, tmp: Path, test: str, header: str, flags: list[str]) -> Path:
        """Compiled anew where it includes the header that was changed."""
        was = self.build / "tests" / f"{test}.o"
        if not header.endswith(".h") or f" {header} " not in was.with_suffix(".d").read_text().replace("\n", " ") + " ":
            return was
        made = tmp / f"{test}.o"
        source = next(TOP.glob(f"tests/*/{test}.c"))
        into = [f"-I{tmp / part}" for part in PARTS] + ["-I.", "-Isim", "-Itests", "-isystem", str(self.build / "unity")]
        defines = ["-D_POSIX_C_SOURCE=200809L", "-DUNITY_INCLUDE_DOUBLE"]
        subprocess.run(["cc", *CFLAGS[:4], *flags, *defines, *into, "-c", str(source), "-o", str(made)], cwd=TOP, check=True, capture_output=True)
        return made

    def killer(self, tmp: Path, file_of_mutant: str, changed: list[str], tests: list[str], flags: list[str]) -> str:
        """The first test that fails with these objects; none: an empty word."""
        for archive in ARCHIVES:
            shutil.copy(self.was / archive, tmp / archive)
        for file in changed:
            subprocess.run(["ar", "r", str(tmp / self.archive(file)), str(self.object(tmp, file))], check=True, capture_output=True)
        for test in tests:
            program = tmp / test
            self.link(test, tmp, program, flags, self.test_object(tmp, test, file_of_mutant, flags))
            if not self.passes(program, 5.0 + 5.0 * self.seconds[test], "asan" if flags else "plain"):
                return test
            program.unlink()
        return ""


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", choices=PARTS)
    arguments.add_argument("--count", type=int, default=300)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--only", metavar="FILE:LINE", action="append", help="every mutant of these lines; LINE may be A-B, or left out")
    arguments.add_argument("--sanitized", action="store_true", help="run what survives under AddressSanitizer and UBSan as well, in tests of two seconds or less")
    arguments.add_argument("--build", type=Path, default=TOP / "build")
    arguments.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    o = arguments.parse_args()
    mutants = of_lines(o.folder, o.only) if o.only else sample(o.folder, o.count, o.seed)
    bench = Bench(o.build.resolve(), o.folder, o.jobs, o.sanitized, set() if o.only else equivalents())
    count = {verdict: 0 for verdict in ("killed", "survived", "equivalent", "same", "invalid")}
    with concurrent.futures.ThreadPoolExecutor(o.jobs) as pool:
        for outcome in pool.map(bench.verdict, mutants):
            m = outcome.mutant
            count[outcome.verdict] += 1
            if outcome.verdict == "survived" or o.only:
                by = f" by {outcome.by}" if outcome.by else ""
                print(f"{m.file}:{m.line}: {outcome.verdict}{by}: {m.what}: {m.before.strip()}", flush=True)
    valid = count["killed"] + count["survived"]
    print(f"{o.folder}: {count['killed']} of {valid} killed, {100.0 * count['killed'] / max(valid, 1):.1f} %; {count['equivalent']} equivalent, "
          f"{count['same']} the same to the compiler, {count['invalid']} that do not compile")
    return 0


if __name__ == "__main__":
    sys.exit(main())
