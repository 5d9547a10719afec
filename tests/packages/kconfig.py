"""kconfig.py KCONFIG OUT [NAME=VALUE...]: reads it by kconfiglib, sets what is said, and writes CMake's set(CONFIG_...) lines."""
import sys
import warnings

import kconfiglib

warnings.simplefilter("error")
known = kconfiglib.Kconfig(sys.argv[1], warn_to_stderr=True)
for setting in sys.argv[3:]:
    name, value = setting.split("=")
    if not known.syms[name].set_value(value):
        sys.exit(f"{name} does not take {value}")
if known.warnings:
    sys.exit("\n".join(known.warnings))
with open(sys.argv[2], "w") as out:
    for name, symbol in known.syms.items():
        if symbol.str_value not in ("", "n") and not name.startswith("ZEPHYR") and symbol.nodes:
            out.write(f"set(CONFIG_{name} {symbol.str_value})\n")
