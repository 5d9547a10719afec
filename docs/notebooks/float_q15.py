# ---
# jupyter:
#   jupytext:
#     formats: py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Float against Q15 for one's own motor
#
# A core without a floating-point unit learns in whole numbers. Is that good enough for your motor? Put in what stands on its
# nameplate, and a guess of its values.

# %%
import matplotlib.pyplot as plt
import numpy as np

import dqwatch

motor = {"pole_pairs": 7, "R_ohm": 0.18, "Ld_H": 110e-6, "Lq_H": 140e-6, "psi_Wb": 6.2e-3, "J_kgm2": 2e-4, "B_Nms_rad": 1e-4}
v_dc_V, i_A, w_m_rad_s, period_s = 24.0, 10.0, 180.0, 50e-6

# %% [markdown]
# A second and a half of it: speed to and fro, and currents that change, which is what learning needs.

# %%
t = np.linspace(0, 1.5, 301)
log = dqwatch.simulate(
    motor,
    scenario="joint_24v",
    profile={"t_s": t, "speed_rad_s": 0.8 * w_m_rad_s * np.sin(2 * np.pi * t / 0.75), "load_Nm": 0.1 * np.sign(np.sin(2 * np.pi * t / 0.4))},
    drive={"v_dc_V": v_dc_V, "dt_s": period_s},
    seed=4,
)
plots = plt.subplots(3, 1, sharex=True, figsize=(8, 5))[1]
log.plot(plots)
for axes, label in zip(plots, ("A", "V", "rad/s")):
    axes.set_ylabel(label)
plt.tight_layout()

# %% [markdown]
# ## As firmware learns
#
# The same estimator in both arithmetics, a hundredth of a second at a time, from start values that are a third too large.

# %%
start = {name: 1.33 * motor[name] for name in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb")} | {"pole_pairs": motor["pole_pairs"]}
plate = {"period_s": period_s, "v_V": v_dc_V / np.sqrt(3), "i_A": i_A, "w_m_rad_s": w_m_rad_s}
signals = ["v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad"]
names = ["R_ohm", "Ld_H", "Lq_H", "psi_Wb"]
rows = round(0.01 / period_s)
course = {}
for arithmetic in ("float", "q15"):
    estimator = dqwatch.Estimator(start, arithmetic=arithmetic, **plate)
    course[arithmetic] = {name: [] for name in names}
    for first in range(0, len(log), rows):
        estimator.block({name: log[name][first : first + rows] for name in signals})
        known = estimator.parameters
        for name in names:
            course[arithmetic][name].append(known[name].value if name in known else np.nan)

# %%
figure, plots = plt.subplots(2, 2, figsize=(9, 5), sharex=True)
for axes, name in zip(plots.flat, names):
    for arithmetic, style in (("float", "-"), ("q15", "--")):
        off = 100 * (np.array(course[arithmetic][name]) / motor[name] - 1)
        axes.plot(0.01 * np.arange(1, len(off) + 1), off, style, label=arithmetic)
    axes.axhline(0, color="black", linewidth=0.8)
    axes.set_ylim(-4, 6)
    axes.set_title(f"{name}, % from the truth")
plots[0, 0].legend()
for axes in plots[1]:
    axes.set_xlabel("t, s")
plt.tight_layout()

# %% [markdown]
# ## The whole log

# %%
dqwatch.compare(log, machine=start)

# %%
apart = {name: 100 * abs(course["q15"][name][-1] / course["float"][name][-1] - 1) for name in names}
for name, percent in apart.items():
    print(f"{name}: float and Q15 are {percent:.3f} % apart at the end")
assert max(apart.values()) < 0.5
for arithmetic in course:
    for name in names:
        assert abs(course[arithmetic][name][-1] / motor[name] - 1) < 0.03, (arithmetic, name)
