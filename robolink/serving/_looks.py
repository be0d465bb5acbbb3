"""A tip that a program's own, calibrated camera saw, look by look."""

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from itertools import combinations
from math import dist
from typing import TYPE_CHECKING, ClassVar, Final

from robolink.errors import CalibrationError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.protocols.spel_callback import read_place
from robolink.serving._judging import (
    CallbackLimits,
    require_own,
    require_poses_sent,
    require_room,
)
from robolink.serving._look_pairs import look_pairs, require_moving

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, Sighting, VerifyResult

LEAST_LOOKS: Final = 4
LEAST_PROOFS: Final = 3
"""At so many angles; at each the tool stands beside its place first, and at it then."""

_SEEN_APART: Final = 10.0
"""In a proof the tip stays before one place of the camera, within so many tolerances: a scale
that is wrong by 5 % then counts for half a tolerance, and a measurement with it shows."""


class ProgramLooks:
    """Looks of an up-looking camera, solved as by ``calibrate camera``; a ``ProgramMeasure``.

    Each pose is followed by how many candidates were found, and X and Y of the one, base, in whole
    thousandths of a millimetre. At each angle the program looks beside the place and then at it:
    the last look counts, and those before it show that the spot moves as the robot does.

    Args:
        limits: What they are held to.
    """

    length: ClassVar[int] = 3

    def __init__(self, limits: CallbackLimits) -> None:
        self._limits = limits
        self._measured: list[Sighting] = []
        self._proving: list[Sighting] = []

    def add(self, flange: Pose, seen: Sequence[str], *, proof: bool) -> int:
        """Take a look; see ``ProgramMeasure``.

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
        """Return how far from where the controller puts it the tip is seen; see ``ProgramMeasure``.

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
    """Refuse pictures that stand still: they show any offset by which the tool was turned.

    A tip that is turned about itself is seen at one place, but never to the last digit.

    Raises:
        CalibrationError: ``picture_stands_still``.
    """
    if len({(look.x_mm, look.y_mm) for look in looks}) == 1:
        raise CalibrationError(
            "picture_stands_still",
            tr("The camera showed the same to the last digit each time."),
        )
