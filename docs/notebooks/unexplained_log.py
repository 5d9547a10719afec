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
# # An unexplained log to a named effect and a flux map
#
# A traction motor's log, and a plain model that does not fit it: what is missing? The drive is simulated, so that what
# `trace` says can be compared with what was put in. `trace` is told nothing of it.

# %%
import matplotlib.pyplot as plt
import numpy as np

import dqwatch

iron = {"saturation_dd_A_Wb3": 4e4, "saturation_qq_A_Wb3": 6e4, "saturation_dq_A_Wb3": 5e4}
log = dqwatch.simulate(scenario="traction_ipm_linear", nonideal=iron)
plots = plt.subplots(3, 1, sharex=True, figsize=(8, 5))[1]
log.plot(plots)
for axes, label in zip(plots, ("A", "V", "rad/s")):
    axes.set_ylabel(label)
plt.tight_layout()

# %% [markdown]
# ## The plain machine
#
# R, L_d, L_q and the magnet's flux leave a residual far above the log's own noise.

# %%
machine = {"pole_pairs": int(log.truth["pole_pairs"])}
plain = dqwatch.fit(log, machine=machine)
plain

# %% [markdown]
# ## What it lacks

# %%
traced = dqwatch.trace(log, machine=machine)
traced

# %%
figure, axes = plt.subplots(figsize=(5, 3))
traced.plot(axes)
axes.set_yscale("log")
plt.tight_layout()

# %% [markdown]
# ## The flux map
#
# Both effects are polynomials of one co-energy, (E52): with x = i_d/I and y = i_q/I the flux linkages are those of the plain
# machine plus the effects' own. `dqwatch trace` writes the same map as `flux_map.csv`, with deviations.

# %%
own = {name: p.value for effect in traced.effects for name, p in effect.parameters.items()}
R, L_d, L_q, psi = (traced.after[name].value for name in ("R_ohm", "Ld_H", "Lq_H", "psi_Wb"))


def flux(i_d, i_q):
    """Flux linkages of d and q, Wb, at currents in A."""
    x, y = i_d / own["i_base_A"], i_q / own["i_base_A"]
    d = own["psi_d2_Wb"] * x**2 + own["psi_d3_Wb"] * x**3 + own["psi_d4_Wb"] * x**4
    q = own["psi_q3_Wb"] * y**3 + own["psi_q5_Wb"] * y**5
    d += own["psi_c12_Wb"] * y**2 + 2 * own["psi_c22_Wb"] * x * y**2 + own["psi_c14_Wb"] * y**4
    q += 2 * own["psi_c12_Wb"] * x * y + 2 * own["psi_c22_Wb"] * x**2 * y + 4 * own["psi_c14_Wb"] * x * y**3
    return psi + L_d * i_d + d, L_q * i_q + q


# %% [markdown]
# What was put in is another law: currents as polynomials of the fluxes, (E31). The two are compared where the log had
# currents.

# %%
a_dd, a_qq, a_dq = iron.values()
psi_m = log.truth["psi_Wb"]
psi_d, psi_q = np.meshgrid(np.linspace(0.0, 0.08, 120), np.linspace(-0.14, 0.14, 120))
i_d = (psi_d - psi_m) * (1 / log.truth["Ld_H"] - 3 * a_dd * psi_m**2)
i_d += a_dd * (psi_d**3 - psi_m**3) + a_dq * psi_d * psi_q**2
i_q = psi_q * (1 / log.truth["Lq_H"] - a_dq * psi_m**2) + a_qq * psi_q**3 + a_dq * psi_d**2 * psi_q

known = np.zeros(i_d.shape, bool)
for d, q in zip(log["i_d_A"][::20], log["i_q_A"][::20]):
    known |= np.hypot(i_d - d, i_q - q) < 12
i_d, i_q, psi_d, psi_q = i_d[known], i_q[known], psi_d[known], psi_q[known]
found_d, found_q = flux(i_d, i_q)
off = 1e3 * np.hypot(found_d - psi_d, found_q - psi_q)

figure, plots = plt.subplots(1, 3, figsize=(11, 3.6), sharey=True)
for axes, value, title in zip(plots, (1e3 * found_d, 1e3 * found_q, off), ("ψ_d, mWb", "ψ_q, mWb", "from the truth, mWb")):
    drawn = axes.tricontourf(i_d, i_q, value, levels=14, cmap="viridis")
    axes.plot(log["i_d_A"][::50], log["i_q_A"][::50], ",", color="white", alpha=0.6)
    axes.set_title(title)
    axes.set_xlabel("i_d, A")
    figure.colorbar(drawn, ax=axes)
plots[0].set_ylabel("i_q, A")
plt.tight_layout()

# %% [markdown]
# Along the q axis: the flux linkage bends, which one L_q cannot do.

# %%
i = np.linspace(0, 300, 60)
figure, axes = plt.subplots(figsize=(6, 3.4))
axes.plot(i, 1e3 * flux(-100.0, i)[1], label="traced, i_d = −100 A")
axes.plot(i, 1e3 * plain.parameters["Lq_H"].value * i, "--", label="plain machine")
near = np.abs(i_d + 100) < 6
axes.plot(i_q[near & (i_q > 0)], 1e3 * psi_q[near & (i_q > 0)], ".", color="black", markersize=3, label="what was put in")
axes.set_xlabel("i_q, A")
axes.set_ylabel("ψ_q, mWb")
axes.legend()
plt.tight_layout()

# %%
assert traced.verdict == "explained"
assert {effect.name for effect in traced.effects} == {"saturation", "cross_saturation"}
print(f"{np.median(off):.3f} mWb in the median, {np.percentile(off, 95):.2f} mWb in 95 of 100 places, of up to {1e3 * psi_q.max():.0f} mWb")
assert np.percentile(off, 95) < 2.0
