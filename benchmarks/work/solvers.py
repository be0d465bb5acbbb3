"""A pivot with covariance and residuals, against what others offer, on the same arrays.

scipy's least_squares is what a person reaches for first; numpy's lstsq on the 3N x 6 system is
the floor of a careful one. scikit-surgerycalibration is the field's own package; ``make bench``
installs it for itself, without the ninety others that it asks for.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from importlib.util import find_spec
from statistics import median
from time import perf_counter_ns
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from benchmarks.table import Amount, Figure
from robolink.calibration import (
    Robust,
    fit_pivot,
    fit_pivot_robust,
    pivot_design,
    quaternion_rotations,
    rotations,
    solve_n_angle,
    solve_pivot,
    uvw_deg,
)
from robolink.calibration.core.least_squares import Floats
from robolink.model import Pose

SIZES = (10, 20, 100, 1_000, 10_000)
PEER = "scikit-surgerycalibration"
THRESHOLD_MM = 0.5
TIP = np.array([4.2, -7.9, 131.6])

_AT_LEAST_S = 0.15
_AT_MOST_S = 5.0
"""Time in seconds after which fewer than five runs are enough: long runs scatter little."""


def measure_solvers() -> Iterator[Figure]:
    """Yield the figures of the pivot solvers."""
    for count in SIZES:
        yield from _plain(count)
    peer = find_spec("sksurgerycalibration") is not None
    for count in SIZES:
        if count != 20:
            yield from _robust(count, peer)


def _plain(count: int) -> Iterator[Figure]:
    positions, turned = _data(count, outliers=0.0)
    poses = [_pose(*row) for row in zip(positions.tolist(), turned, strict=True)]
    ours = _median_us(lambda: pivot(positions, turned))
    whole = _median_us(lambda: solve_pivot(poses))
    scipy = _median_us(lambda: by_scipy(positions, turned, "trf"))
    quick = _median_us(lambda: by_scipy(positions, turned, "lm"))
    floor = _median_us(lambda: by_lstsq(positions, turned))
    name = f"pivot of {count} poses,"
    goal, us = 1 / 20 if count == 20 else None, Amount(ours, "us")
    for against, peer_us, wanted in (
        ("scipy least_squares", scipy, goal),
        ("scipy least_squares, lm", quick, None),
        ("numpy lstsq alone", floor, None),
    ):
        figures = (Amount(peer_us, "us"), ours / peer_us, wanted)
        yield Figure(f"{name} covariance and residuals", us, against, *figures)
    checked = (Amount(whole, "us"), "scipy least_squares", Amount(scipy, "us"))
    yield Figure(f"{name} every check", *checked, whole / scipy)
    if count >= 1_000:
        yield _from_poses(
            name, lambda: solve_pivot(poses), lambda: with_covariance(positions, turned)
        )
        level = [Pose(p.x_mm, p.y_mm, p.z_mm, 360.0 * k / count) for k, p in enumerate(poses)]
        flat = rotations(np.array([pose.coordinates()[3:] for pose in level]))
        name = f"n_angle of {count} poses,"
        yield _from_poses(name, lambda: solve_n_angle(level), lambda: in_the_plane(positions, flat))


def _from_poses(name: str, whole: Callable[[], object], floor: Callable[[], object]) -> Figure:
    """Measure the two in turn, a pair at a time: other work of the machine hits both alike."""
    whole(), floor()
    pairs: list[tuple[int, int]] = []
    while sum(map(sum, pairs)) < 2 * _AT_LEAST_S * 1e9:
        pairs.append((_once_ns(whole), _once_ns(floor)))
    ours_us, floor_us = (median(column) / 1000 for column in zip(*pairs, strict=True))
    return Figure(
        f"{name} every check",
        Amount(ours_us, "us"),
        "lstsq with covariance",
        Amount(floor_us, "us"),
        median(ours / bare for ours, bare in pairs),
        3.0,
    )


def _robust(count: int, peer: bool) -> Iterator[Figure]:
    positions, turned = _data(count, outliers=0.2)
    # One set of draws, like the other programs; a calibration makes five.
    robust = Robust(threshold_mm=THRESHOLD_MM, seeds=(1,))
    fit, kept = fit_pivot_robust(positions, turned, robust, sigma_mm=None)
    wrong = float(np.linalg.norm(fit.tip - TIP))
    ours = _median_us(lambda: fit_pivot_robust(positions, turned, robust, sigma_mm=None))
    name = f"robust pivot of {count} poses, 20 % outliers,"
    found = f"{name} {wrong:.3f} mm off, {int(kept.sum())} kept"
    if not peer:
        yield Figure(found, Amount(ours, "us"), f"{PEER} is not installed")
        return
    from sksurgerycalibration.algorithms.pivot import pivot_calibration_with_ransac

    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = turned, positions

    def theirs() -> Floats:
        with redirect_stdout(None), warnings.catch_warnings(action="ignore"):  # it prints
            tip: Floats = pivot_calibration_with_ransac(matrices, 100, THRESHOLD_MM, 0.25)[0]
        return tip

    off = float(np.linalg.norm(theirs().ravel() - fit.tip))
    them = _median_us(theirs)
    goal = 1 / 50 if count == 100 else None
    against = f"{PEER}, {off:.3f} mm apart"
    yield Figure(found, Amount(ours, "us"), against, Amount(them, "us"), ours / them, goal)


def whole_pivot_us(count: int) -> float:
    """Return the microseconds of a pivot of so many poses, with every check."""
    positions, turned = _data(count, outliers=0.0)
    poses = [_pose(*row) for row in zip(positions.tolist(), turned, strict=True)]
    return _median_us(lambda: solve_pivot(poses))


def pivot(positions: Floats, turned: Floats) -> tuple[Floats, Floats, Floats]:
    """Return tip, covariance and residuals by the product's own functions."""
    design = pivot_design(turned)
    fit = fit_pivot(positions, turned, condition_number=design.condition_number)
    flat = fit.residuals.ravel()
    variance = float(flat @ flat) / (flat.size - 6)
    return fit.tip, design.unit_covariance * variance, fit.residuals


def by_scipy(
    positions: Floats, turned: Floats, method: Literal["trf", "lm"]
) -> tuple[Floats, Floats, Floats]:
    """Return the same from scipy's least_squares; trf is what it takes unasked."""
    found = least_squares(
        lambda x: (positions + turned @ x[:3] - x[3:]).ravel(), np.zeros(6), method=method
    )
    variance = 2 * found.cost / (3 * len(positions) - 6)
    covariance = variance * np.linalg.inv(found.jac.T @ found.jac)
    return found.x[:3], covariance[:3, :3], found.fun


def by_lstsq(positions: Floats, turned: Floats) -> Floats:
    """Return tip and point by lstsq of the whole system, without any uncertainty."""
    whole = np.hstack((turned.reshape(-1, 3), np.tile(-np.eye(3), (len(positions), 1))))
    return np.linalg.lstsq(whole, -positions.ravel(), rcond=None)[0].astype(float)


def with_covariance(positions: Floats, turned: Floats) -> tuple[Floats, Floats, Floats]:
    """Return tip and point by lstsq, their covariance and the residuals."""
    size = positions.shape[1]
    whole = np.hstack((turned.reshape(-1, size), np.tile(-np.eye(size), (len(positions), 1))))
    found = np.linalg.lstsq(whole, -positions.ravel(), rcond=None)[0].astype(float)
    residuals = whole @ found + positions.ravel()
    variance = float(residuals @ residuals) / (residuals.size - 2 * size)
    return found, variance * np.linalg.inv(whole.T @ whole), residuals


def in_the_plane(positions: Floats, turned: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the same of X and Y."""
    return with_covariance(positions[:, :2], turned[:, :2, :2])


def _data(count: int, *, outliers: float) -> tuple[Floats, Floats]:
    """Return flange positions and rotations with 0.1 mm of noise and outliers of 30 mm."""
    random = np.random.default_rng(5)
    turned = quaternion_rotations(random.normal(size=(count, 4)) * (0.3, 0.3, 1.0, 1.0))
    positions = np.array([350.0, -120.0, 85.0]) - turned @ TIP
    positions += random.normal(0, 0.1, positions.shape)
    spoilt = random.permutation(count)[: int(outliers * count)]
    positions[spoilt] += random.normal(0, 30.0, (len(spoilt), 3))
    return positions, turned


def _pose(place: list[float], turned: Floats) -> Pose:
    x, y, z = place
    u, v, w = uvw_deg(turned)
    return Pose(x, y, z, u, v, w)


def _median_us(act: Callable[[], object]) -> float:
    act()
    times: list[int] = []
    while sum(times) < _AT_LEAST_S * 1e9 or (len(times) < 5 and sum(times) < _AT_MOST_S * 1e9):
        times.append(_once_ns(act))
    return median(times) / 1000


def _once_ns(act: Callable[[], object]) -> int:
    start = perf_counter_ns()
    act()
    return perf_counter_ns() - start
