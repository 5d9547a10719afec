"""PySINDy on the logs that `dqwatch trace` saw: terms found against true terms, error of R, time; beside ours.

usage: sindy.py DIR R_ohm, where DIR holds CASE.csv and CASE/trace.json and CASE/usage of each case below.

Identification with control: states i_d, i_q; inputs are all else. PySINDy is given every true term, among others: the products with speed,
the dead time's shape with its true width, harmonics of the angle, the other axis. It smooths and differentiates by itself. Columns are
normalised, which favours it. The window of its smoothing and the threshold of STLSQ are those that do best on the half of the log that
the fit did not see; the truth has no part in that.
"""
import json
import os
import sys
import time
import warnings

import numpy as np
import pysindy as ps

warnings.filterwarnings("ignore")
FOLDER, R_TRUE = sys.argv[1], float(sys.argv[2])
WIDTH_A = 0.15
PLAIN = ({"i_d", "w*i_q", "v_d"}, {"i_q", "w*i_d", "w", "v_q"})
CASES = {
    "servo": ("clean servo", (set(), set()), []),
    "effect_dead_time": ("dead time", ({"D_d"}, {"D_q"}), ["dead_time"]),
    "effect_angle_offset": ("angle offset", ({"w"}, set()), ["angle_offset"]),
}


def features(log):
    i_d, i_q, theta, w = log["i_d_A"], log["i_q_A"], log["theta_e_rad"], 4 * log["w_m_rad_s"]
    c, s = np.cos(theta), np.sin(theta)
    alpha, beta = c * i_d - s * i_q, s * i_d + c * i_q
    a, b, g = (np.tanh(i / WIDTH_A) for i in (alpha, (np.sqrt(3) * beta - alpha) / 2, -(np.sqrt(3) * beta + alpha) / 2))
    loss_alpha, loss_beta = (2 * a - b - g) / 3, (b - g) / np.sqrt(3)
    # A voltage is the mean from its row to the next; the derivative at a row is centred there.
    v = {n: np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1])]) for n, x in (("v_d", log["v_d_V"]), ("v_q", log["v_q_V"]))}
    return {
        "w*i_d": w * i_d, "w*i_q": w * i_q, "w": w, **v,
        "D_d": c * loss_alpha + s * loss_beta, "D_q": c * loss_beta - s * loss_alpha,
        "cos6": np.cos(6 * theta), "sin6": np.sin(6 * theta), "w*cos6": w * np.cos(6 * theta), "w*sin6": w * np.sin(6 * theta),
        "cos": c, "sin": s, "w^2*i_d": w * w * i_d, "w^2*i_q": w * w * i_q, "i_d^2": i_d**2, "i_q^2": i_q**2, "i_d*i_q": i_d * i_q,
    }


def fitted(x, u, dt, names, window, threshold):
    model = ps.SINDy(
        optimizer=ps.STLSQ(threshold=threshold, alpha=1e-6, normalize_columns=True, max_iter=50),
        feature_library=ps.PolynomialLibrary(degree=1),
        differentiation_method=ps.SmoothedFiniteDifference(smoother_kws={"window_length": window, "polyorder": 2}),
    )
    model.fit(x, t=dt, u=u, feature_names=names)
    return model


def identify(path):
    log = np.genfromtxt(path, delimiter=",", names=True)
    x = np.column_stack([log["i_d_A"], log["i_q_A"]])
    inputs = features(log)
    u = np.column_stack([column / np.std(column) for column in inputs.values()])
    names, dt, half = ["i_d", "i_q", *inputs], log["t_s"][1] - log["t_s"][0], len(x) // 2
    start = time.time()
    best = (-np.inf, None)
    for window in (3, 5, 9, 15):
        for threshold in np.geomspace(1e2, 1e6, 13):
            model = fitted(x[:half], u[:half], dt, names, window, threshold)
            # Judged by the least smoothing, whatever it learned with.
            truth = ps.SmoothedFiniteDifference(smoother_kws={"window_length": 3, "polyorder": 2})._differentiate(x[half:], dt)
            error = truth - np.asarray(model.predict(x[half:], u=u[half:]))
            terms = np.count_nonzero(model.coefficients())
            score = -0.5 * error.size * np.log(np.mean(error**2)) - terms * np.log(error.size)
            if score > best[0]:
                best = (score, (window, threshold))
    model = fitted(x, u, dt, names, *best[1])
    took = time.time() - start
    found = [{("1", *names)[k] for k in np.flatnonzero(row)} for row in model.coefficients()]
    resistances = []
    for row, axis in zip(model.coefficients(), "dq"):
        at_i, at_v = 1 + names.index("i_" + axis), 1 + names.index("v_" + axis)
        if row[at_i] and row[at_v]:
            resistances.append(-row[at_i] / row[at_v] * np.std(inputs["v_" + axis]))
    return found, np.mean(resistances) if resistances else np.nan, took, best[1]


print(f"PySINDy {ps.__version__}, logs of 20 000 rows, 1 % noise; R is {R_TRUE} ohm")
print(f"{'log':14} {'tool':8} {'true terms':>12} {'others':>7} {'R error':>9} {'seconds':>8}")
for case, (title, extra, effects) in CASES.items():
    found, r, took, (window, threshold) = identify(os.path.join(FOLDER, case + ".csv"))
    true = [p | e for p, e in zip(PLAIN, extra)]
    hits, others = sum(len(f & t) for f, t in zip(found, true)), [n for f, t in zip(found, true) for n in sorted(f - t)]
    print(f"{title:14} {'PySINDy':8} {f'{hits} of {sum(map(len, true))}':>12} {len(others):7d} {100 * (r / R_TRUE - 1):+8.1f} % {took:7.1f}"
          f"   window {window}, threshold {threshold:.3g}; missed: {' '.join(n for f, t in zip(found, true) for n in sorted(t - f)) or 'none'}"
          f"; too many: {' '.join(others) or 'none'}")
    trace = json.load(open(os.path.join(FOLDER, case, "trace.json")))
    named = [e["name"] for e in trace["effects"]]
    r = trace["after"]["parameters"]["R_ohm"]["value"]
    seconds = float(open(os.path.join(FOLDER, case, "usage")).read().split()[0])
    # Its plain model always has the seven plain terms; an effect counts as the terms that it stands for.
    hits = sum(map(len, PLAIN)) + sum(len(e) for e in extra) * (set(named) >= set(effects))
    print(f"{'':14} {'dqwatch':8} {f'{hits} of {sum(map(len, true))}':>12} {len(set(named) - set(effects)):7d} {100 * (r / R_TRUE - 1):+8.1f} % {seconds:7.1f}"
          f"   {trace['verdict']}: {' '.join(named) or 'no effect'}")
