"""A drive simulated by motulator 0.5, written as a log that dqwatch reads.

usage: export.py LOG.csv     the interior magnet machine of motulator's examples, two seconds of speed and load steps
"""

from __future__ import annotations

import csv
import math
import sys
from typing import Any

import numpy as np


def write_log(sim: Any, path: str) -> None:
    """What the controller of a finished simulation has seen and done, a row a period of `ctrl.clock`.

    Units    SI; i_d, i_q amplitude invariant as motulator's own; w_m mechanical, motulator's w_m is electrical
    Range    a synchronous machine, `sensorless=False`, a delay of one period (motulator's default)
    """
    seen, asked = sim.ctrl.data.fbk, sim.ctrl.data.ref
    t = np.asarray(asked.t, dtype=float)
    period = float(asked.T_s[0])
    pole_pairs = sim.mdl.machine.par.n_p
    duty = np.asarray(asked.d_abc, dtype=float)
    a = np.exp(2j * math.pi / 3)
    stator = 2 / 3 * (duty @ np.array([1, a, a**2])) * np.asarray(seen.u_dc)
    # The duty of a period acts in the next one. It stands still in the stator: seen from the rotor its mean is turned
    # by half a period, and a little shorter.
    acts = np.concatenate([[0], stator[:-1]])
    w_e, theta = np.asarray(seen.w_m, dtype=float), np.asarray(seen.theta_m, dtype=float)
    half = 0.5 * period * w_e
    v = acts * np.exp(-1j * (theta + half)) * np.sinc(half / math.pi)
    i = np.asarray(seen.i_ss) * np.exp(-1j * theta)
    columns = {"t_s": t, "v_d_V": v.real, "v_q_V": v.imag, "i_d_A": i.real, "i_q_A": i.imag, "w_m_rad_s": w_e / pole_pairs,
               "theta_e_rad": theta}
    with open(path, "w", newline="") as log:
        writer = csv.writer(log)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values())))


def example() -> Any:
    """A 2.2 kW machine: up to half of its speed, load, field weakening's side of i_d, and back."""
    from motulator.drive import model
    from motulator.drive.control import sm as control
    from motulator.drive.utils import SynchronousMachinePars

    par = SynchronousMachinePars(n_p=3, R_s=3.6, L_d=0.036, L_q=0.051, psi_f=0.545)
    mdl = model.Drive(model.VoltageSourceConverter(u_dc=540), model.SynchronousMachine(par),
                      model.StiffMechanicalSystem(J=0.015))
    cfg = control.CurrentReferenceCfg(par, nom_w_m=2 * math.pi * 75, max_i_s=1.5 * math.sqrt(2) * 4.3)
    ctrl = control.CurrentVectorControl(par, cfg, J=0.015, T_s=100e-6, sensorless=False)
    ctrl.ref.w_m = lambda t: 2 * math.pi * (37 * (t > 0.1) - 20 * (t > 1.0) + 40 * (t > 1.5))
    mdl.mechanics.tau_L = lambda t: 14.0 * (t > 0.5) - 10.0 * (t > 1.2)
    sim = model.Simulation(mdl, ctrl)
    sim.simulate(t_stop=2.0, max_step=25e-6)
    return sim


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    write_log(example(), sys.argv[1])
