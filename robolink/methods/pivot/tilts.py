"""How a tool is tilted over a pin: in which orientations, and on which path between them.

Which of them an arm can take up shows at the first touch; others then replace the rest.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from robolink.calibration import Floats, rotation_of, select_poses, uvw_deg
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import NO_OFFSET
from robolink.procedures.samples import TouchNames
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import Consider, Move, Notify, Procedure

TURNS_DEG: Final = (0.0, 60.0, 120.0, 180.0, -120.0, -60.0)

STEP_DEG: Final = 10.0
"""Largest tilt of a tool in one movement, degrees. Between two poses with the tip at one height the
joints lower the tip by L a^2 / 8, with L from the wrist to the tip: by 0.4 % of L."""


@dataclass(frozen=True, slots=True)
class Tilt:
    """A tool's orientation against its first one.

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
    """Where a frame has to go so that a tip is above a pin.

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
        return replace(self, pin_mm=tip_place(pose, self.tip))

    def pose(self, tilt: Tilt, above_mm: float) -> Pose:
        """Return the pose of the frame with the tip so far above the pin."""
        turn = _rotation(tilt.turn_deg, 0.0, 0.0)
        lean = _rotation(0.0, tilt.lean_deg, tilt.roll_deg)
        own = _rotation(*self.frame.components()[3:])
        turned = turn @ rotation_of(self.first) @ own.T @ lean @ own
        x, y, z = (np.array(self.pin_mm) - turned @ self.tip.components()[:3]).tolist()
        u, v, w = uvw_deg(turned)
        return replace(self.first, x_mm=x, y_mm=y, z_mm=z + above_mm, u_deg=u, v_deg=v, w_deg=w)


def tip_place(pose: Pose, tip: ToolOffset) -> tuple[float, float, float]:
    """Return where a tip is, base, with its frame in a pose; only its place in the frame counts."""
    x, y, z = (np.array(pose.coordinates()[:3]) + rotation_of(pose) @ tip.components()[:3]).tolist()
    return x, y, z


def informative_tilts(count: int, tilt_deg: float) -> tuple[Tilt, ...]:
    """Return the orientations of ``count`` touches after one without tilt, the best first.

    Args:
        count: How many.
        tilt_deg: How far the tool leans.
    """
    return best_tilts(tilts_around(tilt_deg), count)


def tilts_around(tilt_deg: float) -> list[Tilt]:
    """Return the orientations among which those of a measurement are chosen."""
    return [Tilt(turn, lean) for turn in TURNS_DEG for lean in (tilt_deg, -tilt_deg)]


def best_tilts(choice: Sequence[Tilt], count: int) -> tuple[Tilt, ...]:
    """Return the ``count`` orientations that tell most besides the first one, the best first."""
    turned = np.array([rotation_of(OverPin(_ANYWHERE, _ORIGIN).pose(one, 0.0)) for one in choice])
    return tuple(choice[index] for index in select_poses(turned, np.eye(3)[np.newaxis], count))


def proving_tilts(tilt_deg: float) -> tuple[Tilt, ...]:
    """Return the orientations of the test of a tip: not measured in, and half a turn apart."""
    return proving_pairs(tilt_deg)[0]


def proving_pairs(tilt_deg: float) -> list[tuple[Tilt, Tilt]]:
    """Return the pairs among which the test chooses, the most informative first."""
    return [
        (Tilt(turn, lean), Tilt(turn - 180.0, lean))
        for lean in (tilt_deg, -tilt_deg, tilt_deg / 2, -tilt_deg / 2)
        for turn in (30.0, 90.0, 150.0)
    ]


def tilt_path(start: Tilt, goal: Tilt) -> Iterator[Tilt]:
    """Yield the orientations of the path, the last one too: back, round, and over again.

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


def _rotation(u_deg: float, v_deg: float, w_deg: float) -> Floats:
    return rotation_of(Pose(0.0, 0.0, 0.0, u_deg, v_deg, w_deg))


class TiltedNames(TouchNames):
    """What all samplers share whose tool is tilted and turned."""

    __slots__ = ()

    @property
    def known(self) -> str:
        """Which lengths become known."""
        return tr("X, Y and Z")

    def named(self, pose: Pose) -> str:
        """Return where one was taken."""
        return tr("U {u:.1f} V {v:.1f} W {w:.1f}", u=pose.u_deg, v=pose.v_deg, w=pose.w_deg)


MOST_DEVIATION_DEG: Final = 1.0
"""Largest difference from the commanded orientation, degrees; a robot further off cannot reach that
orientation."""


def tilt_in_air(over: OverPin, stands: Tilt, goal: Tilt, lift_mm: float) -> Procedure[None]:
    """Tilt a lifted tool with its tip where it is.

    Args:
        over: The place above which the tip is.
        stands: How the tool stands.
        goal: How it is to stand.
        lift_mm: How far above the place the tip is.

    Raises:
        CalibrationError: ``not_tilted``: the robot stands otherwise than it was told.
    """
    for tilt in tilt_path(stands, goal):
        target = over.pose(tilt, lift_mm)
        reached: Pose = yield Move(target, Path.JOINT, tr("Tilting and turning in the air."))
        amiss_deg = apart_deg(target, reached)
        if amiss_deg > MOST_DEVIATION_DEG:
            raise CalibrationError(
                "not_tilted",
                tr(
                    "The tool is {amiss:.1f} degrees from the orientation it was sent to.",
                    amiss=amiss_deg,
                ),
                remedy=tr(
                    "This robot cannot reach it, and stands still with the tip "
                    "lifted. Tilt less with {tilt}, or teach the poses and give "
                    "{points}.",
                    tilt=remedy_word(RemedyWord.TILT),
                    points=remedy_word(RemedyWord.TAUGHT_POINTS),
                ),
            )


LEAST_TILTS: Final = 3
"""Smallest number of tilts: with the first touch four poses, the fewest for a pivot."""


def tilts_in_reach(
    over: OverPin, wanted: Sequence[Tilt], lift_mm: float
) -> Procedure[tuple[Tilt, ...]]:
    """Return the wanted orientations, or the most informative of those that the arm can reach.

    Where the pin is shows at the first touch, and with it which orientations are in reach: inside
    the limits, and away from a singular wrist. Others lean as far, or half as far.

    Args:
        over: The pin as the first touch showed it.
        wanted: The orientations of the plan.
        lift_mm: How far above the pin the tool tilts.

    Raises:
        CalibrationError: ``not_tilted``: fewer than three are left; nothing was tilted.
    """
    refusals = yield from _refusals(over, wanted, lift_mm)
    if not any(refusals):
        return tuple(wanted)
    first = next(filter(None, refusals))
    tilt_deg = max(abs(tilt.lean_deg) for tilt in wanted)
    choice = [*tilts_around(tilt_deg), *tilts_around(tilt_deg / 2)]
    found = yield from _refusals(over, choice, lift_mm)
    free = [tilt for tilt, refusal in zip(choice, found, strict=True) if not refusal]
    if len(free) < LEAST_TILTS:
        raise _not_tilted(first)
    chosen = best_tilts(free, min(len(wanted), len(free)))
    yield Notify(
        tr(
            "{missed} of the {count} planned tilts cannot be reached over this pin: "
            "{why} Others replace them, {chosen} in all.",
            missed=sum(map(bool, refusals)),
            count=len(wanted),
            why=first,
            chosen=len(chosen),
        )
    )
    return chosen


def free_tilts(
    over: OverPin, choice: Sequence[Tilt], lift_mm: float
) -> Procedure[tuple[Tilt, ...]]:
    """Return which of many orientations the arm can reach over a place, in their order.

    Args:
        over: The place as the first touch showed it.
        choice: What there is to choose from.
        lift_mm: How far above it the tool tilts.

    Raises:
        CalibrationError: ``not_tilted``: fewer than three are left; nothing was tilted.
    """
    refusals = yield from _refusals(over, choice, lift_mm)
    free = tuple(tilt for tilt, refusal in zip(choice, refusals, strict=True) if not refusal)
    if len(free) < LEAST_TILTS:
        raise _not_tilted(next(filter(None, refusals)))
    if len(free) < len(choice):
        yield Notify(
            tr(
                "{missed} of {count} tilts cannot be reached here: {why} The touches "
                "are chosen from the others.",
                missed=len(choice) - len(free),
                count=len(choice),
                why=next(filter(None, refusals)),
            )
        )
    return free


def proving_in_reach(
    over: OverPin, wanted: Sequence[Tilt], lift_mm: float
) -> Procedure[tuple[Tilt, ...]]:
    """Return the orientations of a test, or the first pair half a turn apart within reach.

    Args:
        over: The pin, and the tip as it was measured.
        wanted: The orientations of the plan.
        lift_mm: How far above the pin the tool tilts.

    Raises:
        CalibrationError: ``not_tilted``: there is no such pair, so nothing is proved.
    """
    refusals = yield from _refusals(over, wanted, lift_mm)
    if not any(refusals):
        return tuple(wanted)
    for pair in proving_pairs(max(abs(tilt.lean_deg) for tilt in wanted)):
        if not any((yield from _refusals(over, pair, lift_mm))):
            return pair
    raise _not_tilted(next(filter(None, refusals)))


def _refusals(over: OverPin, tilts: Sequence[Tilt], lift_mm: float) -> Procedure[list[str]]:
    """Return for each orientation why the arm cannot go there and touch, empty if it can."""
    ways = [tuple(_way(over, tilt, lift_mm)) for tilt in tilts]
    told: tuple[str, ...] = yield Consider(tuple(move for moves in ways for move in moves))
    left = iter(told)
    return [next(filter(None, [next(left) for _ in moves]), "") for moves in ways]


def _way(over: OverPin, tilt: Tilt, lift_mm: float) -> Iterator[Move]:
    """Yield the movements of a touch: tilting in the air, down to the pin, up again."""
    for between in tilt_path(UPRIGHT, tilt):
        yield Move(over.pose(between, lift_mm), Path.JOINT, "")
    for above_mm in (0.0, lift_mm):
        yield Move(over.pose(tilt, above_mm), Path.STRAIGHT, "")


def _not_tilted(why: str) -> CalibrationError:
    return CalibrationError(
        "not_tilted",
        tr("Too few orientations can be reached over this pin: {why}", why=why),
        remedy=tr(
            "Nothing was tilted. Put the pin where the arm has room to all sides, tilt less with "
            "{tilt}, or teach the poses and give {points}.",
            tilt=remedy_word(RemedyWord.TILT),
            points=remedy_word(RemedyWord.TAUGHT_POINTS),
        ),
    )
