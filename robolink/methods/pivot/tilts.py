"""How a tool is tilted over a pin: in which orientations, and on which way from one to the next."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from robolink.calibration import Floats, rotation_of, rotations, select_poses, uvw_deg
from robolink.model import Pose, ToolOffset
from robolink.procedures import NO_OFFSET

TURNS_DEG: Final = (0.0, 60.0, 120.0, 180.0, -120.0, -60.0)

STEP_DEG: Final = 10.0
"""A tool leans by at most this in one movement. Between two poses with the tip at one height the
joints let it sink by L a^2 / 8, with L from the wrist to the tip: by 0.4 % of L."""


@dataclass(frozen=True, slots=True)
class Tilt:
    """How the tool stands against its first orientation.

    Attributes:
        turn_deg: Turned so far about the base's Z.
        lean_deg: And leaned so far about the flange's own Y, which five axes can do as well.
        roll_deg: And so far about its own X, which takes six.
    """

    turn_deg: float = 0.0
    lean_deg: float = 0.0
    roll_deg: float = 0.0


UPRIGHT: Final = Tilt()

_ANYWHERE: Final = Pose(0.0, 0.0, 0.0, 0.0)

_ORIGIN: Final = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class OverPin:
    """Where a frame has to go for a tip to be above a pin.

    Attributes:
        first: Pose of the frame in the first orientation, wherever.
        pin_mm: Where the pin is, base, as far as it is known.
        tip: The tip, seen from the frame; only its place counts.
        frame: The frame, seen from the flange; only its orientation counts.
    """

    first: Pose
    pin_mm: tuple[float, float, float]
    tip: ToolOffset = NO_OFFSET
    frame: ToolOffset = NO_OFFSET

    @classmethod
    def touched(cls, first: Pose, guess: ToolOffset) -> "OverPin":
        """Return it for the flange, which touched the pin with a tip at about ``guess``."""
        return cls(first, _ORIGIN, guess).moved_to(first)

    def moved_to(self, pose: Pose) -> "OverPin":
        """Return it for the place where the tip is with the frame in a pose."""
        x, y, z = (rotation_of(pose) @ self.tip.components()[:3]).tolist()
        return replace(self, pin_mm=(pose.x_mm + x, pose.y_mm + y, pose.z_mm + z))

    def pose(self, tilt: Tilt, above_mm: float) -> Pose:
        """Return the pose of the frame with the tip so far above the pin."""
        turn, lean = rotations(
            np.array([(tilt.turn_deg, 0.0, 0.0), (0.0, tilt.lean_deg, tilt.roll_deg)])
        )
        own = _own_rotation(self.frame)
        turned = turn @ rotation_of(self.first) @ own.T @ lean @ own
        x, y, z = (np.array(self.pin_mm) - turned @ self.tip.components()[:3]).tolist()
        u, v, w = uvw_deg(turned)
        return replace(self.first, x_mm=x, y_mm=y, z_mm=z + above_mm, u_deg=u, v_deg=v, w_deg=w)


def informative_tilts(count: int, tilt_deg: float) -> tuple[Tilt, ...]:
    """Return the orientations of ``count`` touches after one that is not tilted, the best first.

    Args:
        count: How many.
        tilt_deg: How far the tool leans.
    """
    return best_tilts(tilts_around(tilt_deg), count)


def tilts_around(tilt_deg: float) -> list[Tilt]:
    """Return the orientations among which those of a measurement are chosen."""
    return [Tilt(turn, lean) for turn in TURNS_DEG for lean in (tilt_deg, -tilt_deg)]


def best_tilts(choice: Sequence[Tilt], count: int) -> tuple[Tilt, ...]:
    """Return the ``count`` orientations that tell the most beside the first one, the best first."""
    turned = np.array([rotation_of(OverPin(_ANYWHERE, _ORIGIN).pose(one, 0.0)) for one in choice])
    return tuple(choice[index] for index in select_poses(turned, np.eye(3)[np.newaxis], count))


def proving_tilts(tilt_deg: float) -> tuple[Tilt, ...]:
    """Return the orientations that prove a tip: not measured in, and half a turn apart."""
    return proving_pairs(tilt_deg)[0]


def proving_pairs(tilt_deg: float) -> list[tuple[Tilt, Tilt]]:
    """Return the pairs among which the proof chooses, the most telling first."""
    return [
        (Tilt(turn, lean), Tilt(turn - 180.0, lean))
        for lean in (tilt_deg, -tilt_deg, tilt_deg / 2, -tilt_deg / 2)
        for turn in (30.0, 90.0, 150.0)
    ]


def tilt_path(start: Tilt, goal: Tilt) -> Iterator[Tilt]:
    """Yield the orientations on the way, the last one too: back, round, and over again.

    It turns where it does not lean, since the arm would else swing a leaning tip.
    """
    if start.turn_deg == goal.turn_deg:
        yield from _leaning(start, goal)
        return
    yield from _leaning(start, Tilt(start.turn_deg))
    turned = Tilt(goal.turn_deg)
    yield turned
    yield from _leaning(turned, goal)


def apart_deg(one: Pose, other: Pose) -> float:
    """Return by which angle two orientations differ."""
    cosine = (np.trace(rotation_of(one).T @ rotation_of(other)) - 1) / 2
    return math.degrees(math.acos(min(1.0, max(-1.0, float(cosine)))))


def _leaning(start: Tilt, goal: Tilt) -> Iterator[Tilt]:
    lean_deg, roll_deg = goal.lean_deg - start.lean_deg, goal.roll_deg - start.roll_deg
    steps = math.ceil(math.hypot(lean_deg, roll_deg) / STEP_DEG)
    for share in np.linspace(0.0, 1.0, steps + 1).tolist()[1:]:
        yield replace(
            start,
            lean_deg=start.lean_deg + share * lean_deg,
            roll_deg=start.roll_deg + share * roll_deg,
        )


def _own_rotation(frame: ToolOffset) -> Floats:
    return rotation_of(Pose(0.0, 0.0, 0.0, *frame.components()[3:]))
