"""Adaptive filters of two libraries on logs: `PEER R Ld Lq psi` in SI, one line a log.

usage: online.py padasip|cmsis LOG.csv ...

Both learn, sample by sample and each axis by itself,
    v_d = R i_d + L_d di_d/dt - L_q (w i_q)        v_q = R i_q + L_q di_q/dt + L_d (w i_d) + psi w
from start values that are 30 % wrong. In their favour:
- currents and speed at the middle of the interval whose mean voltage the row holds;
- every regressor divided by its RMS over the log, which an online user does not know beforehand;
- L_d and L_q read where they multiply w i (good at speed), not the differenced current, which noise shrinks; R from the d axis, which has
  one unknown less. READ=own in the environment reads both L at the differenced current and R as the mean of the axes.

padasip: FilterRLS, forgetting 1 (it advises near 1, like 0.99), eps 0.1, last weights. FilterNLMS is no better.

cmsis: arm_lms_f32 of CMSIS-DSP, step 3e-4, weights averaged over the second half. arm_lms_norm_f32 is no better.
Its LMS is a tapped delay line and takes no regressor vector: the elements are pushed one after another with the step at zero, and only the
last one, when the line holds the whole vector, learns. It is the C function inside the Python package, which hides the weights.

SMOOTH=N in the environment first takes moving means over N rows, the same for every column.
"""
import ctypes
import os
import sys

import numpy as np

POLE_PAIRS = 4
R, LD, LQ, PSI = 0.65, 0.7e-3, 1.82e-3, 14e-3
RLS_FORGETTING, RLS_EPS = 1.0, 0.1
LMS_STEP = 3e-4
COLUMNS = ("t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s")
SMOOTH = int(os.environ.get("SMOOTH") or 1)
READ_OWN = os.environ.get("READ") == "own"


def load(path):
    with open(path) as file:
        header = [name.strip() for name in file.readline().split(",")]
        table = np.loadtxt(file, delimiter=",", usecols=[header.index(name) for name in COLUMNS], unpack=True)
    return [np.convolve(column, np.full(SMOOTH, 1 / SMOOTH), "valid") for column in table] if SMOOTH > 1 else table


def axes(path):
    """Regressors, voltage and start weights of the d and the q axis."""
    t, v_d, v_q, i_d, i_q, w = load(path)
    w = POLE_PAIRS * w
    dt = (t[-1] - t[0]) / (len(t) - 1)
    middle = lambda x: (x[1:] + x[:-1]) / 2
    x_d = np.column_stack([middle(i_d), np.diff(i_d) / dt, -middle(w * i_q)])
    x_q = np.column_stack([middle(i_q), np.diff(i_q) / dt, middle(w * i_d), middle(w)])
    return (x_d, v_d[:-1], np.array([R, LD, LQ])), (x_q, v_q[:-1], np.array([R, LQ, LD, PSI]))


def rls(x, y, start):
    peer = padasip.filters.FilterRLS(len(start), mu=RLS_FORGETTING, eps=RLS_EPS, w=start)
    peer.run(y, x)
    return peer.w


FLOATS = ctypes.POINTER(ctypes.c_float)


class LmsInstance(ctypes.Structure):
    """arm_lms_instance_f32"""

    _fields_ = [("taps", ctypes.c_uint16), ("state", FLOATS), ("weights", FLOATS), ("step", ctypes.c_float)]


def lms(x, y, start):
    taps = len(start)
    x = np.ascontiguousarray(x, np.float32)
    wanted = np.zeros_like(x)
    wanted[:, -1] = y
    weights, state = start.astype(np.float32), np.zeros(2 * taps, np.float32)
    out, error = np.zeros(taps, np.float32), np.zeros(taps, np.float32)
    peer = LmsInstance()
    LMS_INIT(ctypes.byref(peer), taps, weights.ctypes.data, state.ctypes.data, 0.0, taps)
    at, out_at, error_at = ctypes.addressof(peer), out.ctypes.data, error.ctypes.data
    x_at, wanted_at, last, half = x.ctypes.data, wanted.ctypes.data, 4 * (taps - 1), len(y) // 2
    mean = np.zeros(taps)
    for k in range(len(y)):
        peer.step = 0.0
        LMS(at, x_at, wanted_at, out_at, error_at, taps - 1)
        peer.step = LMS_STEP
        LMS(at, x_at + last, wanted_at + last, out_at, error_at, 1)
        x_at, wanted_at = x_at + last + 4, wanted_at + last + 4
        if k >= half:
            mean += weights
    return mean / (len(y) - half)


def identify(path, learn):
    found = []
    for x, y, start in axes(path):
        scale = np.sqrt(np.mean(x**2, axis=0))
        found.append(learn(x / scale, y, start * scale) / scale)
    d, q = found
    return ((d[0] + q[0]) / 2, d[1], q[1], q[3]) if READ_OWN else (d[0], q[2], d[2], q[3])


name, paths = sys.argv[1], sys.argv[2:]
if name == "padasip":
    import padasip

    learner = rls
elif name == "cmsis":
    import cmsisdsp_filtering

    library = ctypes.CDLL(cmsisdsp_filtering.__file__)
    LMS, LMS_INIT = library.arm_lms_f32, library.arm_lms_init_f32
    LMS.restype = LMS_INIT.restype = None
    LMS.argtypes = [ctypes.c_void_p] * 5 + [ctypes.c_uint32]
    LMS_INIT.argtypes = [ctypes.c_void_p, ctypes.c_uint16, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_float, ctypes.c_uint32]
    learner = lms
else:
    sys.exit(f"no peer {name}: padasip or cmsis")
for path in paths:
    print(name, *(f"{value:.6e}" if np.isfinite(value) else "-" for value in identify(path, learner)), flush=True)
