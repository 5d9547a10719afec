#!/usr/bin/env python3
"""A public header as Doxygen wants it, on stdout, line for line: the file's first comment is the file's own, `Units    SI`
of a docstring is an item of a list, prototypes on neighbouring lines share one docstring, and what an object keeps to
itself is hidden.

usage: c_filter.py HEADER
"""

import re
import sys

ITEM = re.compile(r"^(\s*)/// (Source|Shape|Units|Range|Returns|Cost|Context)  *(\S.*)$")
# Callers own their bytes and read none of them.
OBJECTS = {name + port for port in ("", "_q15")
           for name in ("dqw_monitor", "dqw_monitor_healthy", "dqw_monitor_stored", "dqw_estimator", "dqw_estimator_random",
                        "dqw_shaft", "dqw_learner", "dqw_random", "dqw_ordinal", "dqw_tapped", "dqw_effect")}
# What objects are made of.
PARTS = {"dqw_estimator_handed", "dqw_estimator_given", "dqw_estimator_q15_handed", "dqw_estimator_q15_given", "dqw_residual_q15",
         "dqw_fault_machine_q15", "dqw_noise", "dqw_noise_variances", "dqw_lasting", "dqw_segment", "dqw_gain",
         "dqw_window_cell", "dqw_window", "dqw_window_part", "dqw_window_rise", "dqw_witness", "dqw_effect_base",
         "dqw_effect"}
PROTOTYPE = re.compile(r"^(?!typedef|struct|static|#|\s|//|return)[\w* ]*?(\w+)\([^;{]*\);")


SEVERAL = re.compile(r"^(\s+)((?:const |enum )*\w+) ([*\w\[\]+ ]+(?:, [*\w\[\]+ ]+)+);(?:\s*///< (.*))?$")


def several(line: str, above: str) -> str:
    """`float a, b;  ///< text`: each name has the text."""
    match = SEVERAL.match(line)
    text = match and (match[4] or above)
    if not match or not text:
        return line
    return match[1] + " ".join(f"{match[2]} {name}; /**< {text} */" for name in match[3].split(", "))


def filtered(lines: list[str]) -> list[str]:
    out: list[str] = []
    heading = True
    hidden = ""
    shared = above = ""
    above_lines = 0
    for line in lines:
        whole = several(line, above)
        if whole != line and above:
            # The text above would be the first name's a second time.
            for n in range(len(out) - 1, len(out) - 1 - above_lines, -1):
                out[n] = ""
        line = whole
        said = re.match(r"\s*/// (.*)", line)
        above = f"{above} {said[1]}".strip() if said else ""
        above_lines = above_lines + 1 if said else 0
        if heading and line.startswith("// "):
            out += ["/// @file"] * (not out) + ["/" + line]
            continue
        if heading and line.startswith("//"):
            out.append("///")
            continue
        if heading and not line.strip():
            heading = False
            continue
        if re.match(r"#define \w+ DQW_SIZED\(", line):
            out.append("")
            continue
        if item := ITEM.match(line):
            line = f"{item[1]}/// - **{item[2]}** {item[3]}"
        if opened := re.match(r"(?:typedef )?struct (\w+) \{$", line):
            hidden = opened[1] if opened[1] in OBJECTS | PARTS else ""
            line += " /** @cond */" if hidden else ""
        if hidden and line in (f"}} {hidden};", "};"):
            line, hidden = "/** @endcond */ " + line, ""
        prototype = PROTOTYPE.match(line)
        if prototype and shared:
            line = f"/** @copydoc {shared} */ {line}"
        shared = prototype[1] if prototype else ""
        out.append(line)
    return out


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as header:
        print("\n".join(filtered(header.read().splitlines())))
