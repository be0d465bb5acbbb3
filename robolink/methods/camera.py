"""camera: a calibrated, up-looking camera sees the tip."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, cast

from annotated_types import MaxLen, MinLen

from robolink.calibration import (
    Sighting,
    VerifyResult,
    height_of,
    seen_from,
    solvable_planes,
    solve_up_camera,
    toward_zero,
)
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    Angle,
    Check,
    Help,
    Method,
    Needs,
    Option,
    Site,
)
from robolink.methods.shared_parameters import (
    PLACE,
    UNMEASURED_Z,
    LookParameters,
    camera_at,
)
from robolink.model import Pose, TipSensor, ToolOffset, checks_arguments
from robolink.procedures import (
    NO_OFFSET,
    CameraDrive,
    CameraSamples,
    LookPlan,
    LookSource,
    MeasurementContext,
    Place,
    PlacedProof,
    ProofBasis,
    calibrated_camera,
    camera_error_of,
    proof_angles,
    radius_of,
    verify_by_looking,
)
from robolink.runner import Procedure, SeenAt
from robolink.sensing import sensor_name
from robolink.stations import CameraStation, StationKind

if TYPE_CHECKING:
    from robolink.calibration import CameraRound
    from robolink.procedures import TipSource


LEAST_TEST_TURN_DEG: Final = 90.0
"""Smallest turn from one of the measured angles to one of the turn test, degrees: less counts as
tested at a small angle."""

_APART_DEG: Final = 5.0
"""Smallest turn from any measured angle to one of the turn test, degrees."""


@dataclass(frozen=True, kw_only=True)
class CameraParameters(LookParameters):
    """How a calibrated camera looks at a tip."""

    test_turns_deg: Annotated[
        tuple[Angle, ...] | None,
        MinLen(1),
        MaxLen(8),
        DEGREES,
        Option(flag="--test-angles", metavar="15,90,.."),
        Help(
            declared(
                "U of each look of the turn test, counted as those of the measurement; without "
                "it, two between them."
            )
        ),
    ] = None

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the turn test can show anything."""
        yield from super().problems(check)
        for number, angle_deg in enumerate(self.test_turns_deg or (), start=1):
            if min(abs(angle_deg - turn_deg) for turn_deg in self.turns_deg) < _APART_DEG:
                yield Problem(
                    f"test_turns_deg#{number}",
                    tr(
                        "must be at least {apart:g} degrees from each of {other}",
                        apart=_APART_DEG,
                        other=check.spell("turns_deg"),
                    ),
                )
        turned = [abs(a - b) for a in self.test_turns_deg or () for b in self.turns_deg]
        if turned and max(turned) < LEAST_TEST_TURN_DEG:
            yield Problem(
                "test_turns_deg",
                tr(
                    "must hold an angle that is at least {least:g} degrees from one of {other}",
                    least=LEAST_TEST_TURN_DEG,
                    other=check.spell("turns_deg"),
                ),
            )

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty if they can."""
        if len(self.turns_deg) > 2:
            return ""
        return tr(
            "cannot be judged: looks at one or two angles cannot check each other; "
            "look at three angles or more, or limit the interval and state the "
            "standard deviation"
        )


@checks_arguments
def measure_camera(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> "Procedure[CameraRound]":
    """Measure X and Y of a tip with a calibrated camera. Runs in Tool 0.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles it is looked at.
        here: Where the flange is; its U is where the angles count from.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``tilted_pose`` before anything moves; ``tip_not_seen``,
            ``several_tips_seen``, ``camera_not_calibrated``, and those of
            :func:`solve_camera_round`.

    Example:
        >>> from robolink.methods import measure_camera
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> camera, here = CameraStation(x_mm=300, y_mm=80, z_mm=-30), Pose(300, 100, 20, 0)
        >>> course = measure_camera(camera, LookPlan(), here=here, stored=ToolOffset(12, -3.5, -20))
        >>> found = PaperCell(here, ToolOffset(12.4, -3.8, -20)).run(course)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.4, -3.8)
    """
    return CameraSource("", station, plan, sigma_mm, retake).procedure(stored, here)


@dataclass(frozen=True, slots=True, kw_only=True)
class LookTest(PlacedProof):
    """All that a turn test by a camera needs.

    Attributes:
        sensor: URL or name of the camera, or the camera itself, which cannot be kept.
        station: Where it is, and what its pixels mean.
        plan: Pictures and heights.
        angles_deg: U of the new tool at which the tip is looked at.
        camera_error_mm: What the measurement found the camera to be off by, base X and Y.
        radius_px: How wide the spot was in the measurement; ``None`` where nobody told.
    """

    method: ClassVar[str] = "camera"
    by_touch: ClassVar[bool] = False

    # A str or a TipSensor; a value read back is a str.
    sensor: object
    station: CameraStation
    plan: LookPlan
    angles_deg: tuple[float, ...]
    camera_error_mm: tuple[float, float] = (0.0, 0.0)
    radius_px: float | None = None

    @property
    def obstacle(self) -> str:
        """Why it cannot be kept: no other process can open a camera that is open here."""
        if not isinstance(self.sensor, str):
            return "camera_open"
        if sensor_name(self.sensor) != self.sensor:
            return "camera_token"  # not stored anywhere
        return ""

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`~robolink.procedures.KeptProof.prove`."""
        # As the source gave it; a record could not restore a type that contains a protocol.
        camera = cast("str | TipSensor", self.sensor)
        here = context.controller.groups[0].pose()
        with calibrated_camera(camera, self.station) as eye:
            return context.run(self.steps(here), tip=self.written, camera=eye)

    def prove_after_a_break(self, context: MeasurementContext) -> VerifyResult:
        """Make it: first straight up, then over the camera."""
        return self.prove(context)

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        return verify_by_looking(
            self.station,
            self.plan,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            camera_error_mm=self.camera_error_mm,
            aside=seen_from(self.written, self.tip),
            radius_px=self.radius_px,
        )


class RoundSource(LookSource):
    """Measures by moving marks before a calibrated camera at every angle of a plan.

    Attributes:
        plan: How they are brought before it.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.
    """

    __slots__ = ()

    plan: LookPlan
    sigma_mm: float | None
    retake: bool

    def procedure(self, stored: ToolOffset | None, here: Pose) -> "Procedure[CameraRound]":
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`.

        Raises:
            CalibrationError: ``tilted_pose`` before anything moves; ``camera_not_calibrated``;
                and as :meth:`CameraDrive.looks`, :meth:`CameraDrive.centred` and :meth:`solved`.
            LimitError: The arm cannot bring the marks before the camera so; nothing was moved.
        """
        solvable_planes([here], height_of(stored))
        station, tool, centred = self.station, stored or NO_OFFSET, False
        drive = CameraDrive(station, self.plan, here)
        angles_deg = yield from drive.angles_in_reach(
            here, lambda angles: self.places(stored or NO_OFFSET, angles)
        )
        if self.plan.centre_first:
            found = self.places(tool, angles_deg[:1])[:2]

            def expected(looks: Sequence[SeenAt]) -> ToolOffset:
                return self.expected([station.sighting(look) for look in looks], stored)

            tool = yield from drive.centred(found, here, expected)
            here, centred = drive.pose(found[-1]), True
        places = self.places(tool, angles_deg)
        marks = [place.mark for place in places]

        def solve(looks: Sequence[SeenAt]) -> "CameraRound":
            return self.solved([station.sighting(look) for look in looks], marks, stored)

        looks = CameraSamples(drive, solve, here, before_camera=centred)
        return (yield from looks.at(places, retake=self.retake))

    @abstractmethod
    def places(self, tool: ToolOffset, angles_deg: Sequence[float]) -> list[Place]:
        """Return every mark at every angle, as something to look at.

        Args:
            tool: Where they are expected.
            angles_deg: U of the frame.
        """

    @abstractmethod
    def expected(self, seen: Sequence[Sighting], stored: ToolOffset | None) -> ToolOffset:
        """Return where the marks are, by looks at the first two places, or at the only one."""

    @abstractmethod
    def solved(
        self, seen: Sequence[Sighting], marks: Sequence[int], stored: ToolOffset | None
    ) -> "CameraRound":
        """Return the result of all looks.

        Args:
            seen: What was seen.
            marks: The mark of each.
            stored: The offset stored now.
        """


@dataclass(frozen=True, slots=True)
class CameraSource(RoundSource):
    """Measures X and Y of a tip by looking at it at several angles of U.

    Attributes:
        plan: How the tip is brought before it.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.
        test_turns_deg: Angles U of the looks of the turn test, counted as those of the plan;
            ``None`` for two between them.
    """

    plan: LookPlan = field(default_factory=LookPlan)
    sigma_mm: float | None = None
    retake: bool = False
    test_turns_deg: tuple[float, ...] | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: seen by the camera {sensor} at {count} angles of U",
            sensor=sensor_name(self.sensor),
            count=len(self.plan.turns_deg),
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Did the camera find the tip, and is it clean? Was the camera moved?")

    def places(self, tool: ToolOffset, angles_deg: Sequence[float]) -> list[Place]:
        """Return the tip at every angle."""
        return [Place(u_deg, tool) for u_deg in angles_deg]

    def expected(self, seen: Sequence[Sighting], stored: ToolOffset | None) -> ToolOffset:
        """Return where the tip is, by one look."""
        return solve_up_camera(seen[0], stored=stored).offset

    def solved(
        self,
        seen: Sequence[Sighting],
        marks: Sequence[int],  # noqa: ARG002 - there is one
        stored: ToolOffset | None,
    ) -> "CameraRound":
        """Solve the looks at the tip."""
        from robolink.calibration import solve_camera_round  # numpy

        return solve_camera_round(
            seen, stored=stored, sigma_mm=self.sigma_mm, camera=self.station.model
        )

    def proof_of(self, basis: ProofBasis) -> LookTest:
        """Return the test at other angles; see :class:`~robolink.procedures.ProvesAgain`."""
        return LookTest(
            **basis.common,
            sensor=self.sensor,
            station=self.station,
            plan=self.plan,
            angles_deg=self._test_angles_deg(basis),
            camera_error_mm=camera_error_of(basis.result),
            radius_px=radius_of(basis.result),
        )

    def _test_angles_deg(self, basis: ProofBasis) -> tuple[float, ...]:
        """Return U of the new tool in the test, turned in the direction of the measurement.

        A measurement that the arm could only make to the other side, or half as far, is tested
        likewise.
        """
        if self.test_turns_deg is None:
            return proof_angles(basis.result, basis.tool)
        planned, measured = self.plan.turns_deg, basis.measured_deg
        first = planned[0]
        far = max(range(len(planned)), key=lambda index: abs(planned[index] - first))
        if planned[far] == first:
            return tuple(toward_zero(measured[0], turn - first) for turn in self.test_turns_deg)
        share = (measured[far] - measured[0]) / (planned[far] - first)
        return tuple(measured[0] + share * (turn - first) for turn in self.test_turns_deg)


def _source(parameters: CameraParameters, site: Site) -> "TipSource":
    sensor, station = camera_at(parameters, site)
    return CameraSource(
        sensor,
        station,
        parameters.look,
        sigma_mm=site.sigma_mm,
        retake=parameters.retake,
        test_turns_deg=parameters.test_turns_deg,
    )


METHOD = Method(
    name="camera",
    summary=declared("See the tip with a calibrated, up-looking camera: X and Y."),
    description=declared(
        "See the tip with an up-looking camera: X and Y; nobody touches anything.\n\nThe scale "
        "of a pixel comes from 'calibrate camera-affine' or the cell file, or the camera "
        "answers in millimetres. Looks at several angles separate the tip from the camera's "
        "own error; a single look trusts the camera."
    ),
    parameters=CameraParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    proof=lambda: LookTest,
)
