"""arm_lms_norm_q15 of CMSIS-DSP on the signals of bench/step_sizes.c, and its weights' error in the same measure.

usage: step_sizes.py PROGRAM <LINES     PROGRAM: bench/step_sizes; LINES: what it prints. Prints lines like them, named `arm_lms_norm_q15`.

Taps, step and signals are Q15; the post shift is 0, since no weight is above 1. Its own normaliser has no constant in it, so it needs fewer
samples than it is given. It is the C function inside the Python package, built for this machine, which hides the weights.
"""
import ctypes
import subprocess
import sys

import cmsisdsp_filtering
import numpy as np

TRUTH = np.array([0.304, -0.26, 0.11, 0.15])
TAPS, EVERY = len(TRUTH), 100
SHORTS = ctypes.POINTER(ctypes.c_int16)


class Instance(ctypes.Structure):
    """arm_lms_norm_instance_q15"""

    _fields_ = [
        ("taps", ctypes.c_uint16),
        ("state", SHORTS),
        ("weights", SHORTS),
        ("step", ctypes.c_int16),
        ("shift", ctypes.c_uint8),
        ("reciprocals", SHORTS),
        ("energy", ctypes.c_int16),
        ("x0", ctypes.c_int16),
    ]


library = ctypes.CDLL(cmsisdsp_filtering.__file__)
LMS, LMS_INIT = library.arm_lms_norm_q15, library.arm_lms_norm_init_q15
LMS.restype = LMS_INIT.restype = None
LMS.argtypes = [ctypes.c_void_p] * 5 + [ctypes.c_uint32]
LMS_INIT.argtypes = [ctypes.c_void_p, ctypes.c_uint16, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int16, ctypes.c_uint32, ctypes.c_uint8]


def error(step, amplitude, samples):
    weights, state = np.zeros(TAPS, np.int16), np.zeros(TAPS + EVERY, np.int16)
    out, rest = np.zeros(EVERY, np.int16), np.zeros(EVERY, np.int16)
    peer = Instance()
    at = ctypes.addressof(peer)
    LMS_INIT(at, TAPS, weights.ctypes.data, state.ctypes.data, round(32768 * step), EVERY, 0)
    squares = []
    with subprocess.Popen([sys.argv[1], str(amplitude), str(samples)], stdout=subprocess.PIPE) as signals:
        for k in range(EVERY, samples + 1, EVERY):
            x, y = (np.ascontiguousarray(c) for c in np.frombuffer(signals.stdout.read(4 * EVERY), np.int16).reshape(-1, 2).T)
            LMS(at, x.ctypes.data, y.ctypes.data, out.ctypes.data, rest.ctypes.data, EVERY)
            if k > samples - samples // 4:
                squares.append(np.sum((weights[::-1] / 32768 - TRUTH) ** 2))
    return 100 * np.sqrt(np.mean(squares) / np.sum(TRUTH**2))


for line in sys.stdin:
    name, step, amplitude, samples, _ = line.split()
    if name == "Q15":
        print("`arm_lms_norm_q15`", step, amplitude, samples, f"{error(float(step), float(amplitude), int(samples)):.6f}", flush=True)
