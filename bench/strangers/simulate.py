"""One drawn log in the environment of its simulator: `python -m strangers.simulate SEED FOLDER` in bench/."""

from __future__ import annotations

import pathlib
import sys

import numpy as np

from . import drive, log
from .draw import Spec, draw


def incremental(iron: object, spec: Spec, rows: drive.Rows) -> list[tuple[float, float]] | None:
    """Incremental inductances where the log was, by the slopes of the current; every 50th row."""
    if iron is None:
        return None
    found = []
    m = spec.machine
    step = 1e-4 * m["psi"]
    for i in rows.i_true[::50]:
        flux = complex(m["psi"], 0)
        for _ in range(40):  # Newton's, the machine's own inductances for the slope
            off = i - iron(flux)  # type: ignore[operator]
            flux += 0.5 * complex(m["Ld"] * off.real, m["Lq"] * off.imag)
        d = (iron(flux + step) - iron(flux - step)).real / (2 * step)  # type: ignore[operator]
        q = (iron(flux + 1j * step) - iron(flux - 1j * step)).imag / (2 * step)  # type: ignore[operator]
        found.append((1 / d, 1 / q))
    return found


def main(seed: int, folder: pathlib.Path) -> None:
    spec = draw(seed)
    random = np.random.default_rng(seed)
    profile = drive.Profile(spec, np.random.default_rng(seed))
    plant: drive.Plant
    controller: drive.Controller
    iron: object = None
    if spec.simulator == "motulator":
        from .motulator_plant import MotulatorController, MotulatorPlant
        plant, controller = (motulator := MotulatorPlant(spec, profile)), MotulatorController(spec)
        iron = motulator.iron
    else:
        from .gem_plant import GemController, GemPlant
        plant, controller = GemPlant(spec, profile), GemController(spec)
    rows = drive.run(spec, plant, controller, np.random.default_rng(seed))
    if not np.isfinite(rows.i).all() or np.abs(rows.i_true).max() > 6 * float(spec.drive["amp"]):
        raise SystemExit(f"seed {seed}: the drive is not in control of its currents")
    log.write(spec, rows, incremental(iron, spec, rows), random, folder / f"stranger_{seed}")


if __name__ == "__main__":
    main(int(sys.argv[1]), pathlib.Path(sys.argv[2]))
