"""Simulated cells whose tip stands before the camera, and what stands in their pictures."""

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

KINDS = {"epson": EpsonSimulator, "softmotion": SoftMotionSimulator}
PLAIN: Final[dict[str, Any]] = {
    "picture_noise_grey": 0.0,
    "picture_clutter": 0,
    "picture_glare": 0.0,
    "camera_noise_px": 0.0,
}
"""Nothing in the picture but what a test is about."""

RADIUS_PX = 25.0


def cell_before_camera(
    kind: str = "epson", seed: int = 3, *, above_mm: float = 0.0, **parameters: Any
) -> Any:
    """Return a simulator whose tip is in the middle of the picture, at a height over the focus."""
    simulator = KINDS[kind](seed=seed, world=WorldParameters(**parameters))
    bring_to(simulator, (0.0, 0.0, above_mm))
    return simulator


def bring_to(simulator: Any, beside_mm: tuple[float, float, float]) -> None:
    """Bring the mounted tip to a place beside the one that the camera looks at."""
    world = simulator.world
    at = zip(world.camera.middle_mm, beside_mm, world.tip_mm(), strict=True)
    world.robot.carry(world.tips[1], tuple(middle + by - tip for middle, by, tip in at))


def turn_to(simulator: Any, by_deg: float) -> None:
    """Turn the tool where its tip is."""
    world = simulator.world
    before = world.tip_mm()
    world.robot.turn(by_deg)
    moved = tuple(a - b for a, b in zip(before, world.tip_mm(), strict=True))
    world.robot.carry(world.tips[1], moved)


def place_px(simulator: Any) -> tuple[float, float]:
    """Return where the tip is in the picture, (0, 0) the middle of the first pixel."""
    world = simulator.world
    x, y = world.camera.optics.image_of(*world.camera.beside(world.tip_mm()))
    return x - 0.5, y - 0.5


def nearest_pixel(simulator: Any) -> tuple[int, int]:
    """Return the pixel that the tip is in."""
    x, y = place_px(simulator)
    return round(x), round(y)


def edge_points(grey: npt.NDArray[Any], at: tuple[float, float], radius: float) -> npt.NDArray[Any]:
    """Return where brightness is half-way down on each of 180 rays; pixels, from ``at``."""
    found = []
    for line, out, (x, y) in _rays(grey, at, np.arange(0.8, 1.35, 0.002) * radius, 180):
        ends = len(out) // 10
        level = (np.median(line[:ends]) + np.median(line[-ends:])) / 2
        last = np.flatnonzero(line < level)[0] - 1
        share = (line[last] - level) / (line[last] - line[last + 1])
        reach = out[last] + share * (out[1] - out[0])
        found.append((reach * x, reach * y))
    return np.array(found)


def edge_width_px(grey: npt.NDArray[Any], at: tuple[float, float], radius: float) -> float:
    """Return the mean width of the outer edge, 10 to 90 %."""
    widths = []
    for line, out, _ in _rays(grey, at, np.arange(0.6, 1.6, 0.002) * radius, 60):
        high, low = line[:20].mean(), line[-20:].mean()
        nine = np.argmax(line < low + 0.9 * (high - low))
        one = np.argmax(line < low + 0.1 * (high - low))
        widths.append((one - nine) * (out[1] - out[0]))
    return float(np.mean(widths))


def _rays(
    grey: npt.NDArray[Any], at: tuple[float, float], out: npt.NDArray[Any], count: int
) -> Iterator[tuple[npt.NDArray[Any], npt.NDArray[Any], tuple[float, float]]]:
    """Yield the brightness along each ray, the distances, and its direction."""
    angles = np.linspace(0, math.tau, count, endpoint=False)
    across, down = np.cos(angles), np.sin(angles)
    x, y = at[0] + np.outer(across, out), at[1] + np.outer(down, out)
    for line, *direction in zip(sampled(grey, x, y), across, down, strict=True):
        yield line, out, (direction[0], direction[1])


def fitted_circle(points: npt.NDArray[Any]) -> tuple[float, float, float]:
    """Return the middle and the radius of the circle that fits points best (Kasa)."""
    x, y = points[:, 0], points[:, 1]
    matrix = np.column_stack((2 * x, 2 * y, np.ones_like(x)))
    (cx, cy, rest), *_ = np.linalg.lstsq(matrix, x * x + y * y, rcond=None)
    return float(cx), float(cy), math.sqrt(rest + cx * cx + cy * cy)


def sampled(grey: npt.NDArray[Any], x: npt.NDArray[Any], y: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the brightness at places between pixels."""
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    x, y = x - left, y - top
    upper = grey[top, left] * (1 - x) + grey[top, left + 1] * x
    lower = grey[top + 1, left] * (1 - x) + grey[top + 1, left + 1] * x
    between: npt.NDArray[Any] = upper * (1 - y) + lower * y
    return between
