"""A person who touches a surface, and a robot that tilts its tool, for procedure tests."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from robolink.calibration import rotation_of
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import TouchPlan
from robolink.runner import Ask, Consider, Move, Notify, TouchedAt

STORED = ToolOffset(12.0, -3.5, -20.0)
TIP = ToolOffset(12.4, -3.2, -20.5)
START = Pose(300.0, 100.0, -50.0, 72.0, tool=0)
PLAN = TouchPlan(lift_mm=12.0, clearance_mm=2.0, seed=5)

_SLIPS = {"right": (0, 0, 0), "x": (0.3, 0, 0), "y": (0, 0.3, 0), "z": (0, 0, 0.3)}


def slips(*robots):
    """Return each robot with a tip that slipped in each direction or in none.

    Each direction is tried with one of two robots; the other runs only in ``make soak``.
    """
    return [
        pytest.param(
            *robot,
            aside,
            id="-".join(map(str, (*robot, name))),
            marks=() if name == "right" or number % 2 == place else pytest.mark.soak,
        )
        for place, robot in enumerate(robots)
        for number, (name, aside) in enumerate(_SLIPS.items())
    ]


class Plate:
    """A plane, tilted toward a direction of the base."""

    def __init__(self, lean_deg=0.0, toward_deg=0.0, point=(300.0, 100.0, -60.0)):
        lean, toward = math.radians(lean_deg), math.radians(toward_deg)
        beside = math.sin(lean)
        self.normal = np.array(
            [beside * math.cos(toward), beside * math.sin(toward), math.cos(lean)]
        )
        self.point = np.array(point)

    def height(self, tip):
        return float((tip - self.point) @ self.normal)

    def way(self, tip):
        return -self.height(tip) * self.normal


class Ball:
    """A sphere."""

    def __init__(self, radius=10.0, centre=(300.0, 100.0, -70.0)):
        self.radius, self.centre = radius, np.array(centre)

    def height(self, tip):
        return float(np.linalg.norm(tip - self.centre)) - self.radius

    def way(self, tip):
        out = tip - self.centre
        return -self.height(tip) * out / np.linalg.norm(out)


class SurfacePerson:
    """Brings the tip onto a surface by the shortest way, except for ``hover``.

    Args:
        surface: The surface.
        tip: The real tip.
        hover: Returns how far from the surface touch ``number`` ends, given the height before.

    ``lowest`` is the least distance of the tip in any movement, ``flown`` the same at the ends of
    movements that are not straight, ``swung`` the sideways travel while the tool was tilted.
    """

    def __init__(self, surface, *, start=START, sigma_mm=0.01, seed=1, tip=TIP, hover=None):
        self.surface, self.tip = surface, tip
        self._random = random.Random(seed)
        self._here, self._sigma_mm = start, sigma_mm
        self._hover = hover or (lambda _number, _height: 0.0)
        self.touches, self.moves, self.lowest = [], [], math.inf
        self.flown, self.swung = math.inf, 0.0

    def run(self, procedure):
        """Carry out every step; return the result."""
        answer = None
        try:
            while True:
                answer = self._answer(procedure.send(answer))
        except StopIteration as finished:
            return finished.value

    def tip_at(self, pose):
        return np.array(pose.coordinates()[:3]) + rotation_of(pose) @ self.tip.components()[:3]

    def _answer(self, step):
        match step:
            case Notify():
                return None
            case Consider():
                return ("",) * len(step.moves)
            case Move():
                self._went(step)
                return self._here
            case Ask():
                return self._touched()

    def _went(self, step):
        before, after = self.tip_at(self._here), self.tip_at(step.target)
        heights = self.surface.height(before), self.surface.height(after)
        self.lowest = min(self.lowest, heights[1])
        if step.path is Path.JOINT:
            self.flown = min(self.flown, *heights)
        if "Tilting" in step.purpose:
            self.swung = max(self.swung, math.dist(before[:2], after[:2]))
        self._here = step.target
        self.moves.append(step)

    def _touched(self):
        at = self.tip_at(self._here)
        height = self.surface.height(at)
        left = self._hover(len(self.touches), height)
        if left != height:
            way = self.surface.way(at) * (1 - left / height)
            error = [self._random.gauss(0, self._sigma_mm) for _ in "xyz"]
            x, y, z = (np.array(self._here.coordinates()[:3]) + way + error).tolist()
            self._here = replace(self._here, x_mm=x, y_mm=y, z_mm=z)
        self.touches.append(self._here)
        return TouchedAt.of(self._here, seconds=2.0)


def touches_of(surface, tip, *, down=False, count=12, seed=3):
    """Return flange poses, upright and tilted to all sides, with a tip on a plane."""
    rng = random.Random(seed)
    poses = []
    for number in range(count):
        lean = 0.0 if number < 3 else 30.0
        toward, u = rng.uniform(0.0, math.tau), rng.uniform(-180.0, 180.0)
        v, w = lean * math.cos(toward), lean * math.sin(toward) + (180.0 if down else 0.0)
        at = Pose(rng.uniform(280, 320), rng.uniform(80, 120), 0.0, u, v, w, tool=0)
        place = np.array(at.coordinates()[:3]) + rotation_of(at) @ tip.components()[:3]
        rise = -surface.height(place) / surface.normal[2]
        poses.append(replace(at, z_mm=rise))
    return poses


def touches_of_ball(ball, tip, *, down=False, count=14, seed=3):
    """Return flange poses, tilted to all sides, with a tip all over the upper half of a sphere."""
    rng = random.Random(seed)
    poses = []
    for _ in range(count):
        toward, u, lean = rng.uniform(0.0, math.tau), rng.uniform(-180.0, 180.0), 30.0
        v, w = lean * math.cos(toward), lean * math.sin(toward) + (180.0 if down else 0.0)
        at = Pose(0.0, 0.0, 0.0, u, v, w, tool=0)
        polar, way = rng.uniform(0.0, 1.0), rng.uniform(0.0, math.tau)
        side = [math.sin(polar) * math.cos(way), math.sin(polar) * math.sin(way), math.cos(polar)]
        place = ball.centre + ball.radius * np.array(side)
        x, y, z = (place - rotation_of(at) @ tip.components()[:3]).tolist()
        poses.append(replace(at, x_mm=x, y_mm=y, z_mm=z))
    return poses
