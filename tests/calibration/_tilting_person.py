"""A person at a pin and a robot that tilts its tool, for procedure tests."""

import math
import random
from dataclasses import replace

import numpy as np

from robolink.calibration import rotation_of
from robolink.model import Hand, Pose, ToolOffset
from robolink.procedures import TouchPlan
from robolink.runner import Ask, Confirm, Consider, Move, Notify, TeachPrompt

STORED = ToolOffset(12.0, -3.5, -20.0)
TIP = ToolOffset(12.4, -3.2, -20.5)
PIN = np.array([300.0, 100.0, -60.0])
PLAN = TouchPlan(lift_mm=10.0, clearance_mm=2.0)
FRAMES = (
    Pose(0.0, 0.0, 0.0, 72.0, tool=0),
    # A six-axis arm whose flange points down, and one with a tilted flange.
    Pose(0.0, 0.0, 0.0, -150.0, 0.0, 180.0, hand=Hand.RIGHT, tool=0),
    Pose(0.0, 0.0, 0.0, 30.0, 8.0, -12.0, tool=0),
)
UPRIGHT = FRAMES[0]


def tip_mm(pose, tip=TIP):
    """Return the place of the tip with the flange in a pose."""
    return np.array(pose.coordinates()[:3]) + rotation_of(pose) @ tip.components()[:3]


def turned_deg(one, other):
    """Return the angle between two orientations."""
    cosine = (np.trace(rotation_of(one).T @ rotation_of(other)) - 1) / 2
    return math.degrees(math.acos(np.clip(cosine, -1.0, 1.0)))


class Person:
    """Touches the pin with an error, and records the flange poses."""

    def __init__(
        self,
        start=UPRIGHT,
        *,
        sigma_mm=0.01,
        slips=(),
        accepts=0,
        seed=1,
        stiff=False,
        reaches=None,
    ):
        self._random = random.Random(seed)
        self._here = start
        self._sigma_mm, self._slips, self._accepts = sigma_mm, set(slips), accepts
        self._stiff = stiff
        self.reaches = reaches
        self.steps, self.touches, self.offers, self.told = [], [], [], []
        self.subjects = []

    def run(self, procedure, tip=TIP):
        """Carry out every step; return the result."""
        answer = None
        try:
            while True:
                answer = self._answer(procedure.send(answer), tip)
        except StopIteration as finished:
            return finished.value

    def _obstacle(self, target):
        return "" if self.reaches is None or self.reaches(target) else "out of reach."

    def _error(self):
        return [self._random.gauss(0, self._sigma_mm) for _ in "xyz"]

    def _shown(self, step):
        raise AssertionError("only touches are asked for here")

    def _answer(self, step, tip):
        match step:
            case Ask(shown=TeachPrompt.PIN):
                error = self._error()
                if len(self.touches) + 1 in self._slips:
                    error[0] += 0.4
                x, y, z = (PIN + error - rotation_of(self._here) @ tip.components()[:3]).tolist()
                self._here = replace(self._here, x_mm=x, y_mm=y, z_mm=z)
                self.touches.append(self._here)
                self.subjects.append(step.subject)
                return self._here
            case Move():
                angles = ("u_deg", "v_deg", "w_deg") if self._stiff else ()
                kept = {name: getattr(self._here, name) for name in angles}
                before, self._here = self._here, replace(step.target, **kept)
                self.steps.append((step, before, self._here))
                return self._here
            case Consider():
                return tuple(self._obstacle(move.target) for move in step.moves)
            case Notify():
                self.told.append(step.text)
                return None
            case Ask():
                return self._shown(step)
            case Confirm():
                self.offers.append(step.question)
                return len(self.offers) <= self._accepts
