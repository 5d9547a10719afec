"""gym-electric-motor on the servo of bench/sim_speed: prints its real-time factor, best of three runs, in processor time.

One environment step is one control period of 0.1 ms: continuous converter, dq voltages held over the step, speed and angle
simulated. The only controller is a proportional one on both currents, which favours this side. Its own default solver.
"""
import sys
import time

import gym_electric_motor as gem
import numpy as np
from gym_electric_motor.physical_system_wrappers import DqToAbcActionProcessor
from gym_electric_motor.physical_systems.mechanical_loads import PolynomialStaticLoad

SPAN_S = float(sys.argv[1]) if len(sys.argv) > 1 else 2.0
DT_S = 1e-4

machine = dict(p=4, l_d=2.2e-3, l_q=2.8e-3, r_s=0.9, psi_p=0.12, j_rotor=2e-3)
limits = dict(omega=400, torque=40, i=40, u=320)
env = gem.make(
    "Cont-CC-PMSM-v0",
    tau=DT_S,
    motor=dict(motor_parameter=machine, nominal_values=limits, limit_values=limits),
    load=PolynomialStaticLoad(load_parameter=dict(a=0, b=1e-3, c=0, j_load=1e-6)),
    supply=dict(u_nominal=320),
    physical_system_wrappers=(DqToAbcActionProcessor.make("PMSM"),),
    constraints=(),
    visualization=(),
    disable_env_checker=True,
)
names = list(env.unwrapped.physical_system.state_names)
at_d, at_q = names.index("i_sd"), names.index("i_sq")

best = 0.0
for run in range(3):
    (state, _), _ = env.reset(seed=run)
    steps = int(SPAN_S / DT_S)
    wanted_q = 0.1
    start = time.process_time()
    for k in range(steps):
        if k % 50 == 0:
            wanted_q = -wanted_q
        action = np.array([-0.8 * state[at_d], 0.8 * (wanted_q - state[at_q])])
        (state, _), _, terminated, _, _ = env.step(action)
        if terminated:
            sys.exit("gym-electric-motor ended the episode: nothing to compare")
    best = max(best, SPAN_S / (time.process_time() - start))
print(f"{best:.3f}")
