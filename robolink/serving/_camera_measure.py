"""A tip that a program's calibrated camera saw, at its places and beside them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from itertools import combinations
from math import dist
from typing import TYPE_CHECKING, ClassVar, Final

from robolink.errors import CalibrationError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.protocols.spel_callback import read_place
from robolink.serving._callback_limits import (
    CallbackLimits,
    require_own,
    require_poses_sent,
    require_room,
)

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, SeenMovement, Sighting, VerifyResult


LEAST_WAY_MM: Final = 0.2
"""Smallest distance of the first look from its place, in mm: from nearer, it is not clear if the
spot moves with the tip."""

_SAME_DEG: Final = 0.05
"""Largest difference between equal orientations, degrees."""

_PLAY_MM: Final = 0.02
"""Largest effect of joint play on a movement, in mm: a program cannot be asked for a closer look.
"""

_FOLLOWS_WITHIN: Final = 0.1


@dataclass(frozen=True, slots=True)
class LookPair:
    """What was seen in one orientation.

    Attributes:
        beside: The look farthest from the place.
        at: The look at the place, the last of them.
    """

    beside: "Sighting"
    at: "Sighting"

    @property
    def way_mm(self) -> float:
        """How far the robot moved between them."""
        one, other = self.beside.flange, self.at.flange
        return math.dist((one.x_mm, one.y_mm), (other.x_mm, other.y_mm))

    def movement(self) -> "SeenMovement":
        """Return what the robot did between them, and what was seen of it."""
        from robolink.calibration import SeenMovement, mm_camera_noise

        start, end = self.beside.flange, self.at.flange
        return SeenMovement(
            (end.x_mm - start.x_mm, end.y_mm - start.y_mm),
            (self.at.x_mm - self.beside.x_mm, self.at.y_mm - self.beside.y_mm),
            mm_camera_noise(),
        )


def look_pairs(looks: "Sequence[Sighting]") -> list[LookPair]:
    """Return the looks of each orientation, in the order in which they were taken.

    Raises:
        CalibrationError: ``no_look_beside``: in one of them nothing shows that the spot moves.
    """
    groups: list[list[Sighting]] = []
    for look in looks:
        if groups and _same_orientation(groups[-1][0], look):
            groups[-1].append(look)
        else:
            groups.append([look])
    pairs = [
        max((LookPair(look, group[-1]) for look in group), key=lambda pair: pair.way_mm)
        for group in groups
    ]
    if any(pair.way_mm < LEAST_WAY_MM for pair in pairs):
        raise CalibrationError(
            "no_look_beside",
            tr("Each place has to be looked at from beside it first, with the tool turned alike."),
        )
    return pairs


def require_moving(pairs: Sequence[LookPair]) -> None:
    """Refuse a spot that does not move as the robot does, and a camera that changed.

    Raises:
        CalibrationError: ``tip_did_not_move`` or ``camera_changed``.
    """
    from robolink.calibration import (
        CameraChangeRows,
        MovementVerdict,
        camera_changed,
        tip_did_not_move,
    )

    movements = [pair.movement() for pair in pairs]
    wrong = [
        movement
        for movement in movements
        if movement.judged(CameraChangeRows(), play_mm=_PLAY_MM) is not MovementVerdict.AS_KNOWN
    ]
    # A camera that changed shows all movements wrong in the same manner. One that is wrong because
    # of play is no reason to refuse the others.
    for movement in wrong:
        steady = all(movement.like(one, within=_FOLLOWS_WITHIN) for one in movements)
        if not steady and math.dist(movement.seen, movement.known_mm) > (
            _FOLLOWS_WITHIN * movement.known_length_mm + 3 * movement.noise
        ):
            raise tip_did_not_move(movement, in_mm=True)
    if len(wrong) == len(movements):
        still = wrong[0].judged(CameraChangeRows(), play_mm=0.0) is MovementVerdict.NONE
        raise tip_did_not_move(wrong[0], in_mm=True) if still else camera_changed(wrong[0])


def _same_orientation(one: "Sighting", other: "Sighting") -> bool:
    a, b = one.flange, other.flange
    turns = ((a.u_deg, b.u_deg), (a.v_deg, b.v_deg), (a.w_deg, b.w_deg))
    return all(abs(math.remainder(x - y, 360.0)) < _SAME_DEG for x, y in turns)


LEAST_LOOKS: Final = 4
LEAST_PROOFS: Final = 3
"""Smallest number of angles; at each, the tool first stops beside its place and then at its place.
"""

_SEEN_APART: Final = 10.0
"""Largest displacement of the tip before the camera in a turn test, in tolerances: a scale that is
wrong by 5 % then makes half a tolerance, and the measurement shows it."""


class ProgramLooks:
    """Looks of an up-looking camera, solved as by ``calibrate camera``; a ``ProgramMeasure``.

    Each pose is followed by how many candidates were found, and X and Y of the one, base, in whole
    thousandths of a millimetre. At each angle the program looks beside the place and then at it:
    the last look counts, and those before it show that the spot moves as the robot does.

    Args:
        limits: What they are held to.
    """

    length: ClassVar[int] = 3
    by_contact: ClassVar[bool] = False

    def __init__(self, limits: CallbackLimits) -> None:
        self._limits = limits
        self._measured: list[Sighting] = []
        self._proving: list[Sighting] = []

    def add(self, flange: Pose, seen: Sequence[str], *, proof: bool) -> int:
        """Add a look; see ``ProgramMeasure``.

        Raises:
            CalibrationError: ``tip_not_seen``, ``several_tips_seen`` or ``too_many_poses``.
            RemoteProtocolError: It is none.
        """
        from robolink.calibration import Sighting

        count, *place = seen
        x_mm, y_mm = read_place(place)
        if not (count.isascii() and count.isdecimal()):
            raise RemoteProtocolError(tr("{field!r} is not a number.", field=count))
        if count.strip("0") == "":
            raise CalibrationError("tip_not_seen", tr("The camera did not see the tip."))
        if count != "1":
            raise CalibrationError(
                "several_tips_seen", tr("The camera saw {count} tips.", count=count)
            )
        looks = self._proving if proof else self._measured
        require_room(len(looks))
        looks.append(Sighting(flange, x_mm, y_mm))
        return len(looks)

    def solve(self, stored: ToolOffset) -> "CalibrationResult":
        """Return the offset; see ``ProgramMeasure``.

        Raises:
            CalibrationError: ``too_few_poses``, ``picture_stands_still``, ``no_look_beside``,
                ``tip_did_not_move``, ``camera_changed``, and those of
                :func:`~robolink.calibration.solve_camera_round`.
        """
        from robolink.calibration import solve_camera_round

        looks = _at_places(self._measured, LEAST_LOOKS)
        return solve_camera_round(looks, stored=stored, sigma_mm=self._limits.sigma_mm)

    def prove(self, result: "CalibrationResult", written: ToolOffset) -> "VerifyResult":
        """Return how far from its place by the controller the tip is seen; see ``ProgramMeasure``.

        Raises:
            CalibrationError: ``too_few_poses``, ``picture_stands_still``, ``no_look_beside``,
                ``tip_did_not_move``, ``camera_changed``, ``proof_is_a_copy``,
                ``insufficient_rotation`` or ``not_turned_about_the_tip``.
        """
        from robolink.calibration import (
            MIN_ROTATION_DEG,
            Drift,
            FlangePlane,
            VerifyResult,
            angle_spread_deg,
        )
        from robolink.procedures import camera_error_of

        limit_mm = self._limits.tolerance_mm
        looks = _at_places(self._proving, LEAST_PROOFS)
        require_own([look.flange for look in looks], result.inputs)
        if angle_spread_deg([look.flange.u_deg for look in looks]) < MIN_ROTATION_DEG:
            raise CalibrationError(
                "insufficient_rotation", tr("The tool is hardly turned in the turn test.")
            )
        places = [(look.x_mm, look.y_mm) for look in looks]
        if any(dist(*pair) > _SEEN_APART * limit_mm for pair in combinations(places, 2)):
            raise CalibrationError(
                "not_turned_about_the_tip",
                tr("In the turn test the tool has to turn about the new tip."),
            )
        error_x, error_y = camera_error_of(result)
        drifts = []
        for look in looks:
            flange = look.flange
            dx, dy = FlangePlane.of(flange).in_base(written.x_mm, written.y_mm, written.z_mm)
            beside = (
                look.x_mm - error_x - flange.x_mm - dx,
                look.y_mm - error_y - flange.y_mm - dy,
            )
            drifts.append(Drift(flange.u_deg, *beside))
        return VerifyResult(tuple(drifts), limit_mm)

    def from_place(
        self,
        result: "CalibrationResult",  # noqa: ARG002 - other measures need it
        written: ToolOffset,  # noqa: ARG002
        proof: "VerifyResult",
    ) -> "VerifyResult":
        """Return the turn test, which already counts from there; see ``ProgramMeasure``."""
        return proof

    def on_record(self) -> Mapping[str, object]:
        """Return what was measured; see ``ProgramMeasure``."""
        return {
            "flange": [list(astuple(look.flange)[:6]) for look in self._measured],
            "seen": [[look.x_mm, look.y_mm] for look in self._measured],
        }


def _at_places(looks: "Sequence[Sighting]", least: int) -> "list[Sighting]":
    """Return the looks at places, once those beside them have shown that the spot moves.

    Args:
        looks: All that were sent.
        least: At how many angles there have to be some.

    Raises:
        CalibrationError: ``too_few_poses``, ``picture_stands_still``, ``no_look_beside``,
            ``tip_did_not_move`` or ``camera_changed``.
    """
    require_poses_sent(len(looks), least)
    _require_new_pictures(looks)
    pairs = look_pairs(looks)
    require_poses_sent(len(pairs), least)
    require_moving(pairs)
    return [pair.at for pair in pairs]


def _require_new_pictures(looks: "Sequence[Sighting]") -> None:
    """Refuse pictures that do not change: they confirm any offset about which the tool turned.

    A tip that is turned about itself is seen at one place, but never to the last digit.

    Raises:
        CalibrationError: ``picture_stands_still``.
    """
    if len({(look.x_mm, look.y_mm) for look in looks}) == 1:
        raise CalibrationError(
            "picture_stands_still",
            tr("The camera showed the same to the last digit each time."),
        )
