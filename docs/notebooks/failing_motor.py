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
# # A motor that fails, watched
#
# The condition monitor of firmware, fed from Python. Six seconds of a servo at work; at 4 s 5 % of the turns of phase a short
# themselves. The monitor knows nothing of it.

# %%
import matplotlib.pyplot as plt
import numpy as np

import dqwatch

fault = {"turn_short": {"value": 0.05, "t_start_s": 4.0, "t_end_s": 4.01}}
log = dqwatch.simulate(scenario="fault_turn_short", nonideal=fault, duration_s=6, seed=1)
plots = plt.subplots(3, 1, sharex=True, figsize=(8, 5))[1]
log.plot(plots)
for axes, label in zip(plots, ("A", "V", "rad/s")):
    axes.axvspan(4, 6, color="tab:red", alpha=0.12)
    axes.set_ylabel(label)
plt.tight_layout()

# %% [markdown]
# Nothing is to be seen there. The monitor is configured from the nameplate, as `dqwatch monitor` does it, and fed a
# twentieth of a second at a time.

# %%
monitor = dqwatch.Monitor.for_log(log, pole_pairs=int(log.truth["pole_pairs"]))
period_s = float(np.median(np.diff(log["t_s"])))
rows = round(0.05 / period_s)
signals = ["t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad"]
events, seen = [], []
for first in range(0, len(log), rows):
    events += monitor.block({name: log[name][first : first + rows] for name in signals})
    seen.append(monitor.status())
for event in events:
    print(f"{event.t_s:.2f} s: {event.fault}, phase {event.phase or '-'}, sure to {event.confidence:.2f}")

# %% [markdown]
# ## What it saw
#
# Shorted turns draw a current that goes with the induced voltage: a ripple twice an electrical turn. R and L hardly move.


# %%
def course(name, key="value"):
    """A channel over time; nothing where it is not known."""
    values = [status["parameters"].get(name, {}).get(key) for status in seen]
    return np.array([np.nan if value is None else value for value in values], dtype=float)


time = [status["t_s"] for status in seen]
names = [name for name in seen[-1]["parameters"] if name.startswith(("R_ohm", "psi_Wb", "short"))]
figure, plots = plt.subplots(len(names), 1, sharex=True, figsize=(8, 2 * len(names)))
for axes, name in zip(plots, names):
    value, sd, healthy, band = (course(name, key) for key in ("value", "sd", "healthy", "band"))
    axes.fill_between(time, healthy - band, healthy + band, color="tab:green", alpha=0.15, label="healthy")
    axes.fill_between(time, value - 2 * sd, value + 2 * sd, color="tab:blue", alpha=0.3)
    axes.plot(time, value, color="tab:blue")
    for event in events:
        axes.axvline(event.t_s, color="tab:red", linestyle="--")
    late = value[len(value) // 4 :]
    axes.set_ylim(np.nanmin(late) - 2 * np.nanmax(sd[len(sd) // 4 :]), np.nanmax(late) + 2 * np.nanmax(sd[len(sd) // 4 :]))
    axes.set_ylabel(name)
plots[0].legend(loc="upper left")
plots[-1].set_xlabel("t, s (dashed: an event)")
plt.tight_layout()

# %% [markdown]
# The same log without the fault says nothing.

# %%
healthy = dqwatch.simulate(scenario="fault_turn_short", nonideal={"turn_short": 0.0}, duration_s=6, seed=1)
quiet = dqwatch.monitor(healthy, pole_pairs=int(log.truth["pole_pairs"]))
quiet

# %%
assert [event.fault for event in events][0] == "turn_short" and events[0].phase == "a"
assert 4.0 < events[0].t_s < 6.0
assert not quiet.events
