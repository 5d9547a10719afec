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
# # A vendor's log to parameters
#
# What VESC Tool writes while an e-bike's hub motor is ridden: twenty rows a second, means between polls, rounded to the
# wire's steps. No such log may be passed on, so this one is of a simulated motor whose values are known.

# %%
import csv

import matplotlib.pyplot as plt
import numpy as np

import dqwatch

hub = {"pole_pairs": 15, "R_ohm": 0.24, "Ld_H": 520e-6, "Lq_H": 650e-6, "psi_Wb": 24.3e-3, "J_kgm2": 0.02}

# %% [markdown]
# Half a minute: the rider asks for another speed every two seconds, the road changes every second.

# %%
random = np.random.default_rng(1)
t = np.linspace(0, 30, 301)
ride = {
    "t_s": t,
    "speed_rad_s": np.interp(t, np.arange(0, 31, 2), random.uniform(8, 40, 16)),
    "load_Nm": np.interp(t, np.arange(0, 31), random.uniform(-3, 6, 31)),
}
seen = dqwatch.simulate(hub, profile=ride, scenario="robot_joint", polled_Hz=20, seed=1)
truth = seen.truth

# %% [markdown]
# The file, in VESC Tool's own layout: electrical revolutions a minute, a semicolon at the end of each line.

# %%
header = (
    "ms_today;input_voltage;temp_mos_max;temp_motor;current_motor;d_axis_current;q_axis_current;erpm;duty_cycle;"
    "fault_code;d_axis_voltage;q_axis_voltage;"
)
with open("ride.csv", "w", newline="") as file:
    file.write(header + "\n")
    writer = csv.writer(file, delimiter=";", lineterminator=";\n")
    erpm = seen["w_m_rad_s"] * hub["pole_pairs"] * 60 / (2 * np.pi)
    duty = np.hypot(seen["v_d_V"], seen["v_q_V"]) * np.sqrt(3) / 48
    for k in range(len(seen)):
        writer.writerow(
            [
                f"{36123400 + 1e3 * seen['t_s'][k]:.0f}",
                "48.0",
                "31.2",
                "25.0",
                f"{seen['i_q_A'][k]:.2f}",
                f"{seen['i_d_A'][k]:.2f}",
                f"{seen['i_q_A'][k]:.2f}",
                f"{erpm[k]:.0f}",
                f"{duty[k]:.3f}",
                "0",
                f"{seen['v_d_V'][k]:.3f}",
                f"{seen['v_q_V'][k]:.3f}",
            ]
        )
print(open("ride.csv").read()[:420])

# %%
plots = plt.subplots(3, 1, sharex=True, figsize=(8, 5))[1]
seen.plot(plots)
for axes, label in zip(plots, ("A", "V", "rad/s")):
    axes.set_ylabel(label)
plt.tight_layout()

# %% [markdown]
# ## Parameters
#
# The format is found by itself. What no log of this kind says is how many pole pairs the motor has.

# %%
result = dqwatch.fit("ride.csv", pole_pairs=15)
result

# %%
names = ["R_ohm", "Lq_H", "psi_Wb"]
error = [100 * (result.parameters[name].value / truth[name] - 1) for name in names]
deviation = [100 * result.parameters[name].sd / truth[name] for name in names]
figure, axes = plt.subplots(figsize=(6, 2.6))
axes.errorbar(error, names, xerr=2 * np.array(deviation), fmt="o", capsize=4)
axes.axvline(0, color="black", linewidth=0.8)
axes.set_xlabel("from the simulated motor's own value, % (bars: two deviations)")
axes.margins(y=0.3)
plt.tight_layout()

# %% [markdown]
# `usable` is what to go by: three deviations within a tenth of the value. The flux is known to a per cent or better from
# such a ride, so the motor's constants are; what is not usable needs a steadier log or a faster one, and says so.

# %%
psi = result.parameters["psi_Wb"]
assert psi.usable and abs(psi.value / truth["psi_Wb"] - 1) < 0.02
print(f"Kv {60 / (2 * np.pi) / (np.sqrt(3) * 15 * psi.value):.2f} rpm/V, line to line, peak")
