"""Robust lines and locations of values with known deviations and a spread of their own between them."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
from scipy.stats import norm

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

CORNER = 1.5  # deviations beyond which a value pulls no harder
_SQUARE = float((2 * norm.cdf(CORNER) - 1) - 2 * CORNER * norm.pdf(CORNER) + 2 * CORNER**2 * norm.sf(CORNER))


@dataclasses.dataclass(frozen=True)
class Line:
    """y = X b: b, its covariance, and the spread that the values have beyond their own deviations."""

    b: Array
    covariance: Array
    spread: float

    @property
    def value(self) -> float:
        """The first coefficient."""
        return float(self.b[0])

    @property
    def sd(self) -> float:
        """Its deviation."""
        return float(np.sqrt(self.covariance[0, 0]))


def _clipped_square(z: Array) -> Array:
    return np.asarray(np.minimum(np.abs(z), CORNER) ** 2)


def spread_of(r: Array, s: Array, parameters: int = 1) -> float:
    """The spread for which residuals r of deviations s have Huber's scale one (his proposal 2); 0 where s suffices."""
    free = max(1, r.size - parameters) * _SQUARE

    def excess(tau: float) -> float:
        return float(np.sum(_clipped_square(r / np.sqrt(s * s + tau * tau)))) - free

    low, high = 0.0, float(np.max(np.abs(r), initial=0.0)) * 4
    if (np.all(s > 0) and excess(0.0) <= 0) or high == 0:
        return 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return 0.5 * (low + high)


def line(X: Array, y: Array, s: Array, spread: float | None = None) -> Line:
    """Huber's regression of y[n] on X[n, p] with deviations s[n]; the spread is found unless it is given.

    Errors: LinAlgError where the columns of X do not come apart.
    """
    n, p = X.shape
    tau = spread if spread is not None else float(np.median(np.abs(y - np.median(y))) / 0.6745)
    total = np.sqrt(s * s + tau * tau)
    total = np.where(total > 0, total, 1e-12)
    b = np.linalg.lstsq(X / total[:, None], y / total, rcond=None)[0]
    if p == 1 and np.ptp(X) == 0:
        b = np.array([np.median(y) / X[0, 0]])
    for _ in range(100):
        r = y - X @ b
        if spread is None:
            tau = spread_of(r, s, p)
        total = np.maximum(np.sqrt(s * s + tau * tau), 1e-12)
        w = np.minimum(1.0, CORNER / np.maximum(np.abs(r / total), 1e-12)) / total**2
        gram = X.T @ (w[:, None] * X)
        new = np.linalg.solve(gram, X.T @ (w * y))
        done = np.all(np.abs(new - b) <= 1e-10 * (1 + np.abs(b)))
        b = new
        if done:
            break
    z = (y - X @ b) / total
    inside = np.abs(z) <= CORNER
    all_of, curved = X.T @ (X / (total**2)[:, None]), X.T @ (inside[:, None] * X / (total**2)[:, None])
    factor = float(np.sum(_clipped_square(z))) / max(1, n - p)
    try:
        bread = np.linalg.inv(curved)
    except np.linalg.LinAlgError:
        bread = np.linalg.inv(all_of)
    return Line(
        np.asarray(b, dtype=np.float64), np.asarray(max(factor, 1e-12) * bread @ all_of @ bread, dtype=np.float64), tau
    )


def location(y: Array, s: Array) -> Line:
    """Robust location of y[n] with deviations s[n], its deviation, and the spread between the values."""
    return line(np.ones((y.size, 1)), y, s)


_FEW = 30


def of_others(y: Array, s: Array) -> tuple[Array, Array, Array]:
    """For each value the location of the others, its deviation, and their spread. Where there are many, one more or
    less is all one, and all share those of all."""
    n = y.size
    if n > _FEW or n < 3:
        one = location(y, s)
        return np.full(n, one.value), np.full(n, one.sd), np.full(n, one.spread)
    each = [location(np.delete(y, k), np.delete(s, k)) for k in range(n)]
    return np.array([e.value for e in each]), np.array([e.sd for e in each]), np.array([e.spread for e in each])


@dataclasses.dataclass(frozen=True)
class Tracks:
    """A line through each motor's windows: level at `day`, slope a day, their deviations (independent)."""

    level: Array
    level_sd: Array
    slope: Array
    slope_sd: Array
    day: Array
    span: Array
    windows: Index
    residual: Array  # of each window


def tracks(motor: Index, day: Array, y: Array, s: Array, motors: int, flat: bool = False) -> Tracks:
    """Huber's line through the windows of every motor at once; motor[n] in 0 … motors − 1. Fewer than three windows, or
    `flat`: a level and no slope (NaN)."""
    count = np.bincount(motor, minlength=motors)
    safe = np.maximum(count, 1)
    clip = np.ones(y.size)
    level = slope = middle = np.zeros(motors)
    lined = (count >= 3) & (not flat)
    first = np.full(motors, np.inf)
    last = np.full(motors, -np.inf)
    np.minimum.at(first, motor, day)
    np.maximum.at(last, motor, day)
    sums = np.zeros(motors)
    spread2 = np.ones(motors)
    r = np.zeros(y.size)

    def total(x: Array) -> Array:
        return np.asarray(np.bincount(motor, x, minlength=motors), dtype=np.float64)

    for _ in range(12):
        w = clip / (s * s)
        sums = np.maximum(total(w), 1e-300)
        middle = total(w * day) / sums
        level = total(w * y) / sums
        dt = day - middle[motor]
        spread2 = total(w * dt * dt)
        slope = np.where(lined & (spread2 > 0), total(w * dt * y) / np.maximum(spread2, 1e-300), 0.0)
        r = y - level[motor] - slope[motor] * dt
        clip = np.minimum(1.0, 2 * CORNER / np.maximum(np.abs(r / s), 1e-12))
    known = count > 0
    ok = lined & (spread2 > 0)
    return Tracks(
        np.where(known, level, np.nan),
        np.where(known, 1 / np.sqrt(sums), np.nan),
        np.where(ok, slope, np.nan),
        np.where(ok, 1 / np.sqrt(np.maximum(spread2, 1e-300)), np.nan),
        np.where(known, middle, np.nan),
        np.where(known, last - first, 0.0),
        np.asarray(count, dtype=np.intp),
        r * np.sqrt(safe[motor] / np.maximum(safe[motor] - (2 if not flat else 1), 1)),
    )


def crossing(
    level: float, level_sd: float, slope: float, slope_sd: float, limit: float, z: float = 1.96
) -> tuple[float, float, float]:
    """Days from the line's middle until it crosses `limit`, and Fieller's interval; infinite where it may never, and
    negative where it is past the limit already."""
    gap = limit - level
    if abs(slope) < 1e-300 or slope * limit <= 0:
        return np.inf, np.inf, np.inf
    at = gap / slope
    # (gap - slope x)^2 = z^2 (level_sd^2 + x^2 slope_sd^2)
    a = slope**2 - (z * slope_sd) ** 2
    b = -2 * gap * slope
    c = gap**2 - (z * level_sd) ** 2
    root2 = b * b - 4 * a * c
    if a <= 0 or root2 < 0:
        return at, 0.0 if at >= 0 else -np.inf, np.inf
    root = np.sqrt(root2)
    low, high = sorted(((-b - root) / (2 * a), (-b + root) / (2 * a)))
    return at, max(0.0, float(low)) if at >= 0 else float(low), float(high)
