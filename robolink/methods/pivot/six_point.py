"""six-point: a pin touched in tilted orientations, and two moves along the tool's axes.

The ways start where the person finds room for them. Along +Z from the pin itself a tool that
points down would be driven into whatever the pin stands on.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Literal

from annotated_types import Ge, Le

from robolink.calibration import CalibrationResult, stated_mm
from robolink.errors import CalibrationError
from robolink.messages import declared, joined, tr
from robolink.methods.method import MM, Help, Method, Needs, Option, PoseHelp, Site
from robolink.methods.pivot import PivotParameters, PivotSource, require_known_tip
from robolink.model import Path, Pose, ToolOffset, checks_arguments
from robolink.procedures import TAKE_ALL, SamplingPolicy, TouchPlan, approach_path, offset_z
from robolink.runner import Ask, Confirm, Move, Notify, Procedure, TeachPrompt, TouchedAt
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.calibration import Floats, SixPointResult
    from robolink.methods.pivot.tilts import Tilt
    from robolink.procedures import PoseMethod, TipSource


USUAL_WAY_MM: Final = 50.0
"""Length of a move that the solver accepts as long enough, in mm; repeated here because the solver
imports numpy, which --help does not need."""


@dataclass(frozen=True, kw_only=True)
class SixPointParameters(PivotParameters):
    """How one pin is touched, and how the axes of the tool are shown."""

    way_mm: Annotated[
        float,
        Ge(10),
        Le(200),
        MM,
        Option(metavar="MM"),
        Help(
            declared(
                "Least length of each of the two moves; longer moves make the axes more accurate."
            )
        ),
    ] = USUAL_WAY_MM
    second_is: Annotated[
        Literal["z", "xz"],
        Option(moves=False),
        Help(
            declared(
                "What the second move shows: the tool's +Z, or its XZ plane on the side of +Z."
            )
        ),
    ] = "z"

    def height_mm(self) -> float:
        """Return how far above the box the flange goes: a move up."""
        return self.way_mm


@dataclass(frozen=True, slots=True)
class AxisTeachPlan:
    """Which moves a person shows, and how long they are.

    Attributes:
        length_mm: Least length of each.
        second_is: ``z``: the second one goes along the tool's +Z; ``xz``: anywhere in its XZ
            plane, on the side of +Z.
    """

    length_mm: float = USUAL_WAY_MM
    second_is: Literal["z", "xz"] = "z"


LEAST_OF_SIX_POINTS = 5


@dataclass(frozen=True, slots=True)
class SixPointSource(PivotSource):
    """Measures as a pivot does, and by moves along the axes of the tool.

    Attributes:
        ways: How the person shows the axes.
    """

    ways: AxisTeachPlan = field(kw_only=True)

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        shown = tr(
            "two moves of {length:g} mm and more along the tool's own axes",
            length=self.ways.length_mm,
        )
        return f"{self._touched}; {shown}"

    def steps(self, stored: ToolOffset | None) -> "Procedure[SixPointResult]":
        """Return the steps of the measurement; see :func:`measure_six_point`."""
        return self._measured(require_known_tip(stored))

    def _measured(self, known: ToolOffset) -> "Procedure[SixPointResult]":
        from robolink.calibration import solve_six_point  # numpy
        from robolink.methods.pivot.procedure import pivot_then_lift

        fit, lifted = yield from pivot_then_lift(self, known)
        showing = _AxisTeaching(self.ways, lifted, known)
        start = yield from showing.start()
        for left in reversed(range(MOST_SHOWINGS)):
            along_x = yield from showing.along(start, TeachPrompt.ALONG_X)
            second = yield from showing.along(start, TeachPrompt.ALONG_Z)
            try:
                result = solve_six_point(
                    fit.inputs,
                    along_x,
                    second,
                    start=start,
                    second_is=self.ways.second_is,
                    stored=known,
                    sigma_mm=self.sigma_mm,
                )
            except CalibrationError as error:
                if error.code != "axes_not_square" or not left:
                    raise
                yield Notify(str(error))
                continue
            yield Notify(_uncertainty(result))
            askew = "ways_askew" in result.warnings
            if not left or not askew or not (yield Confirm(tr("Show both moves again?"))):
                break
        yield from approach_path(lifted, here=start, purpose=tr("Moving back above the pin."))
        return result

    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that repeat one touch.

        The ways along the axes stay as they were shown: they begin and end away from the pin.
        """
        return self._retaken(require_known_tip(stored), here, taken, again)

    def _retaken(
        self, known: ToolOffset, here: Pose, taken: Sequence[TouchedAt], again: int | None
    ) -> Procedure[CalibrationResult]:
        from robolink.calibration import solve_six_point  # numpy
        from robolink.methods.pivot.procedure import retake_pivot

        *touches, start, along_x, second = taken
        fit = yield from retake_pivot(self, known, here=here, taken=touches, again=again)
        result = solve_six_point(
            fit.inputs,
            along_x,
            second,
            start=start,
            second_is=self.ways.second_is,
            stored=known,
            sigma_mm=self.sigma_mm,
        )
        yield Notify(_uncertainty(result))
        return result


@checks_arguments
def measure_six_point(
    plan: TouchPlan,
    ways: AxisTeachPlan,
    *,
    tilts: "Sequence[Tilt]",
    stored: ToolOffset,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> "Procedure[SixPointResult]":
    """Measure a whole tool frame. Runs in Tool 0.

    The touches go as in :func:`measure_pivot`. Then the person shows the axes. A way that cannot
    be used is said at once, and the person goes on from where the tool stands. Ways that are not
    square are both asked for again; those that are a little askew may be. It ends as
    :func:`measure_pivot` does.

    Args:
        plan: Lift and clearance.
        ways: The ways along the axes.
        tilts: Orientations of the further touches.
        stored: The offset stored now. Its orientation only says about where a way will lead, and
            which one is worth a question.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        sampling: When the touches end, and whether one may be taken again.

    Raises:
        CalibrationError: ``turned_on_the_way``, ``short_axis`` and ``axes_not_square`` when the
            person was told so three times; and as :func:`measure_pivot`.

    Example:
        >>> from robolink.methods import AxisTeachPlan, informative_tilts, measure_six_point
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> true, stored = ToolOffset(12.3, -3.9, -20.6, 9), ToolOffset(12, -4, -20, 10)
        >>> cell = PaperCell(Pose(300, 100, 20, 0), true, (310, 95, -40))
        >>> found = cell.run(
        ...     measure_six_point(
        ...         TouchPlan(), AxisTeachPlan(), tilts=informative_tilts(6, 30), stored=stored
        ...     )
        ... )
        >>> round(found.offset.z_mm, 3), round(found.offset.u_deg, 3)
        (-20.6, 9.0)
    """
    source = SixPointSource(tuple(tilts), plan, sigma_mm, sampling, ways=ways)
    return source.steps(stored)


@dataclass(frozen=True, slots=True)
class SixPoints:
    """Touches of one pin, then a move along the tool's X and one along its Z, or in its XZ plane.

    Attributes:
        second_is: What the last pose shows: ``z`` the tool's +Z, ``xz`` its XZ plane.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    second_is: Literal["z", "xz"] = "z"
    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve five poses and more, the last two away from the pin.

        See :class:`~robolink.procedures.PoseMethod`.
        """
        from robolink.calibration import solve_six_point  # numpy, imported only when used

        if len(flange) < LEAST_OF_SIX_POINTS:
            raise CalibrationError(
                "too_few_poses",
                tr("{count} poses were given; the method needs five.", count=len(flange)),
                remedy=tr(
                    "Give three or more on the pin, better four and more, then one along X and one "
                    "along Z."
                ),
            )
        *pivot, along_x, second = flange
        return solve_six_point(
            pivot,
            along_x,
            second,
            second_is=self.second_is,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )


_SIDE_DEG: Final = 90.0

MOST_SHOWINGS: Final = 3
"""How often a person is asked for the same thing before the refusal ends the measurement."""


@dataclass(frozen=True, slots=True)
class _AxisTeaching:
    """Asks a person for poses that show the axes of a tool.

    Attributes:
        ways: The ways along the axes.
        lifted: Where the flange stands at first; its orientation is kept.
        stored: The offset stored now.
    """

    ways: AxisTeachPlan
    lifted: Pose
    stored: ToolOffset

    def start(self) -> Procedure[Pose]:
        """Let a person move the tool to where both moves start."""
        from robolink.calibration import require_unturned

        lowest_mm = min(
            self._foreseen_mm(way)[2] for way in (TeachPrompt.ALONG_X, TeachPrompt.ALONG_Z)
        )
        ask = Ask(
            tr(
                "Jog the tip, without turning it, to where it is free to go {length:g} mm "
                "along the tool's own +X, and {length:g} mm along its own +Z.",
                length=self.ways.length_mm,
            ),
            TeachPrompt.ROOM,
            offset_z(self.lifted, max(0.0, -lowest_mm)),
        )
        return (yield from _shown(ask, lambda pose: require_unturned(self.lifted, pose)))

    def along(self, start: Pose, way: TeachPrompt) -> Procedure[Pose]:
        """Let a person show one move; the flange is back at ``start`` afterwards."""
        from robolink.calibration import axis_displacement

        dx_mm, dy_mm, dz_mm = self._foreseen_mm(way).tolist()
        foreseen = replace(
            start, x_mm=start.x_mm + dx_mm, y_mm=start.y_mm + dy_mm, z_mm=start.z_mm + dz_mm
        )
        ask = Ask(self._instruction(way), way, foreseen)
        for left in reversed(range(MOST_SHOWINGS)):
            end = yield from _shown(
                ask, lambda pose: axis_displacement(start, pose, wanted_mm=self.ways.length_mm)
            )
            yield Move(start, Path.STRAIGHT, tr("Moving back to where the move began."))
            if not left or not (yield from self._doubted(start, end, way)):
                break
        return end

    def _doubted(self, start: Pose, end: Pose, way: TeachPrompt) -> Procedure[bool]:
        """Return whether a move deviates far from its stored axis, and must be shown again.

        A way in a plane may lead anywhere on its side.
        """
        from robolink.calibration import FAR_DEG, axis_displacement, between_deg, rotation_of

        turn = rotation_of(start)
        far_deg = between_deg(turn @ axis_displacement(start, end), self._foreseen_mm(way))
        in_plane = way is TeachPrompt.ALONG_Z and self.ways.second_is == "xz"
        if far_deg <= (_SIDE_DEG if in_plane else FAR_DEG):
            return False
        again: bool = yield Confirm(
            tr(
                "This move is {angle:.0f} degrees off the stored {axis}. Show it again?",
                angle=far_deg,
                axis="+X" if way is TeachPrompt.ALONG_X else "+Z",
            )
        )
        return again

    def _foreseen_mm(self, way: TeachPrompt) -> "Floats":
        """Return a move in the base, by the stored orientation."""
        from robolink.calibration import rotation_of

        own = rotation_of(Pose(0.0, 0.0, 0.0, *self.stored.components()[3:]))
        axis = rotation_of(self.lifted) @ own[:, 0 if way is TeachPrompt.ALONG_X else 2]
        foreseen: Floats = self.ways.length_mm * axis
        return foreseen

    def _instruction(self, way: TeachPrompt) -> str:
        length_mm = self.ways.length_mm
        if way is TeachPrompt.ALONG_X:
            return tr(
                "Jog the tip {length:g} mm or more along the tool's own +X, without turning it.",
                length=length_mm,
            )
        if self.ways.second_is == "z":
            return tr(
                "Jog the tip {length:g} mm or more along the tool's own +Z, without turning it.",
                length=length_mm,
            )
        return tr(
            "Jog the tip {length:g} mm or more in the tool's own XZ plane, on the side of its +Z, "
            "without turning it.",
            length=length_mm,
        )


def _shown(ask: Ask, check: Callable[[Pose], object]) -> Procedure[Pose]:
    """Ask for a pose until it passes; the person continues from where the tool is.

    Raises:
        CalibrationError: That of ``check``, the third time.
    """
    for _ in range(MOST_SHOWINGS - 1):
        pose: Pose = yield ask
        try:
            check(pose)
        except CalibrationError as error:
            yield Notify(str(error))
        else:
            return pose
    last: Pose = yield ask
    check(last)
    return last


def _uncertainty(result: "SixPointResult") -> str:
    """Return how well the moves agree with each other, in one sentence."""
    half_deg = max(result.half_width95[3:], default=None)
    off_deg = result.off_square_deg
    if off_deg is None:
        said = tr("The moves show the axes.")
    else:
        said = tr("The moves are {off:.2f} degrees off a right angle.", off=abs(off_deg))
    if half_deg is None:
        return said
    if "ways_askew" in result.warnings:
        doubted = tr("The touches explain less than that: a move was not quite along its axis.")
        return joined(" ", (said, doubted))
    known = tr("U, V and W: repeatable to +-{half} degrees (95 %).", half=stated_mm(half_deg))
    return joined(" ", (said, known))


def _source(parameters: SixPointParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot import require_tilting
    from robolink.methods.pivot.tilts import informative_tilts  # numpy, for this robot alone

    require_tilting(site.controller, METHOD.name)
    return SixPointSource(
        informative_tilts(parameters.count - 1, parameters.tilt_deg),
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
        ways=AxisTeachPlan(parameters.way_mm, parameters.second_is),
    )


def _from_poses(parameters: SixPointParameters, site: Site) -> "PoseMethod":
    return SixPoints(parameters.second_is, site.sigma_mm)


METHOD = Method(
    name="six-point",
    summary=declared("A pivot and two moves along the tool's axes: all six components."),
    description=declared(
        "Find all six components: a pivot, then a move along the tool's X and one along its "
        "Z.\n\nThe touches go as in 'calibrate pivot'. Then, in the air and without turning, "
        "you jog the tip to where it has room, and along the tool's own +X. The robot goes "
        "straight back, and you jog along the tool's own +Z. robolink refuses at once a move "
        "that is too short or has turned. The work box is higher by the length of a move.\n\n"
        "With existing poses nothing moves: three or more on one pin, tilted and turned; the "
        "last two, in this order, after a move along +X and one along +Z, both from the last "
        "pose on the pin."
    ),
    parameters=SixPointParameters,
    measures=("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True, tilt=True),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("The points on the pin, then the one along X and the one along Z."),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it five times or more."),
        path=declared("A file of poses that state X to W."),
    ),
)
