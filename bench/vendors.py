"""Vendors' logs as `dqwatch fit` takes them, beside what is known of their machines: a section of docs/measured.md.

Samples named SYNTHETIC hold a stated motor in a vendor's exact layout; the others are real.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

HEADING = "## Vendors' logs"
MOTORS = {
    "A": (7, "50 mΩ, 40 µH, 4.00 mWb"),
    "B": (4, "20 mΩ, 0.2 and 0.5 mH, 65 mWb"),
    "C": (7, "5.6 Ω, 2 mH, 12 mWb"),
}
AK80 = "2.63 mWb by the maker's 100 rpm/V; R alone about 95 mΩ"
OPEN = "p ψ 253 mWb if between lines; −3.6 % of the volts for 43 K"
RI50 = "a shaft between two motors: not stated"
# What no file says, and what is known of the machine.
SAMPLES = {
    "SYNTHETIC_mesc_fastloop.txt": ("A", [], ""),
    "SYNTHETIC_mesc_status_json.txt": ("A", [], ""),
    "SYNTHETIC_openinverter_motor_data.csv": ("B", ["--v-dc", "350"], ""),
    "SYNTHETIC_openinverter_web_log.csv": ("B", [], ""),
    "SYNTHETIC_simplefoc_monitor_all.txt": ("C", ["--period", "0.05"], ""),
    "SYNTHETIC_vesc_express_log.csv": ("A", [], ""),
    "SYNTHETIC_vesc_sampled_data.csv": ("A", [], ""),
    "SYNTHETIC_vesc_tool_rt.csv": ("A", [], ""),
    "SYNTHETIC_vescstate_plotjuggler.csv": ("A", [], ""),
    "SYNTHETIC_vescstate_rostopic_echo.csv": ("A", [], ""),
    "edrive_oc_20C_result.csv": ("", ["--pole-pairs", "1"], OPEN),
    "edrive_oc_65C_result.csv": ("", ["--pole-pairs", "1"], OPEN),
    "floatcontrol_demo.csv": ("", ["--pole-pairs", "15"], "hub motor, not named"),
    "moteus_dyno_futek_05_05_2021_12-41-03.csv": ("", ["--pole-pairs", "7"], RI50),
    "moteus_dyno_futek_24_04_2021_16-07-36.csv": ("", ["--pole-pairs", "7"], RI50),
    "odri_speed_test1.txt": ("", ["--pole-pairs", "12"], "0.53 Ω, 210 µH, 1.53 mWb by its firmware"),
    "tmotor_Measuring_velocities_1_rps.csv": ("", ["--gear", "9", "--pole-pairs", "21"], AK80),
    "tmotor_eff_1667828286.70403.csv": ("", ["--gear", "9", "--pole-pairs", "21"], AK80),
    "tmotor_eff_1667828588.0588076.csv": ("", ["--gear", "9", "--pole-pairs", "21"], AK80),
}
UNITS = {
    "R_ohm": ("mΩ", 1e3),
    "Ld_H": ("µH", 1e6),
    "Lq_H": ("µH", 1e6),
    "psi_Wb": ("mWb", 1e3),
    "J_kgm2": ("10⁻⁶ kg m²", 1e6),
    "B_Nms_rad": ("µNms/rad", 1e6),
}
SYMBOLS = {"R_ohm": "R", "Ld_H": "L_d", "Lq_H": "L_q", "psi_Wb": "ψ", "J_kgm2": "J", "B_Nms_rad": "B"}


def rounded(value, sd):
    """Both to two digits of the deviation."""
    digits = 1 - math.floor(math.log10(sd)) if sd > 0 else 2
    return f"{value:.{max(digits, 0)}f} ± {sd:.{max(digits, 0)}f}"


def found(result):
    cells = []
    for name, (unit, factor) in UNITS.items():
        if name in result["parameters"]:
            estimate = result["parameters"][name]
            usable = "" if estimate["usable"] else " (not usable)"
            figures = rounded(factor * estimate["value"], factor * estimate["sd"])
            cells.append(f"{SYMBOLS[name]} {figures} {unit}{usable}")
    return ", ".join(cells) or "nothing is identifiable"


def line_of(command, log, extra, reference):
    options = " ".join(f"`{a} {b}`" for a, b in zip(extra[::2], extra[1::2]))
    with tempfile.TemporaryDirectory() as folder:
        # An open circuit's volts are of lines or of phases, which no file says.
        table = pathlib.Path(folder, "x.toml")
        if log.name.startswith("edrive"):
            table.write_text('[columns]\nv_q_V = { from = "average_voltage", unit = "V RMS line" }\n', encoding="utf-8")
            extra = [*extra, "--machine", str(table)]
            options += ", `V RMS line`"
        run = subprocess.run([command, "fit", "--json", *extra, str(log)], capture_output=True, text=True, check=False)
    if not run.stdout:
        what = run.stderr.strip().splitlines()[-1].replace(str(log.parent) + "/", "").replace("|", "/")
        return f"| {log.name} | {options} | – | refused: {what.split('; a ')[0]} | {reference} |"
    result = json.loads(run.stdout)
    return f"| {log.name} | {options} | {result['regime']}, {result['rows']} | {found(result)} | {reference} |"


def section(command, folder):
    lines = [
        HEADING,
        "",
        "`dqwatch fit` of each sample, told only what no file says. SYNTHETIC: a stated motor in a vendor's exact",
        "layout, 24 to 40 rows; the others are real excerpts.",
        "",
        "| log | told | regime, rows | found | known |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, (motor, extra, reference) in SAMPLES.items():
        log = folder / name
        if not log.exists():
            continue
        pairs, known = MOTORS.get(motor, (0, reference))
        lines.append(line_of(command, log, extra + (["--pole-pairs", str(pairs)] if pairs else []), known))
    return "\n".join(lines) + "\n"


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("command", help="build/dqwatch")
    arguments.add_argument("data", type=pathlib.Path, help="folder of the logs; vendors' are in its folder vendor")
    arguments.add_argument("page", type=pathlib.Path, help="docs/measured.md: its section is written anew")
    a = arguments.parse_args()
    folder = a.data / "vendor"
    if not folder.is_dir():
        print(f"vendors: no folder {folder}; {a.page} keeps its section", file=sys.stderr)
        return 0
    text = a.page.read_text(encoding="utf-8")
    before, _, _ = text.partition(HEADING)
    a.page.write_text(before.rstrip("\n") + "\n\n" + section(a.command, folder), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
