"""board: a held board, seen by its fiducials."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, Annotated, ClassVar

from annotated_types import Ge, Len

from robolink.calibration import (
    LEAST_SPACING_MM,
    BoardDrawing,
    Sighting,
    VerifyResult,
    seen_from,
    solve_board,
)
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.camera import LookTest, RoundSource
from robolink.methods.method import (
    MM,
    Check,
    Help,
    Method,
    Needs,
    NextStep,
    Option,
    Pair,
    Site,
)
from robolink.methods.shared_parameters import (
    PLACE,
    UNMEASURED_Z,
    LookParameters,
    Turns,
    camera_at,
)
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    NO_ERROR,
    NO_OFFSET,
    TWO_ANGLES_DEG,
    CameraDrive,
    LookPlan,
    Place,
    ProofBasis,
    camera_error_of,
    nearest_first,
    proof_angles,
)
from robolink.procedures.camera_looks import look_again
from robolink.runner import Procedure
from robolink.sensing import sensor_name
from robolink.stations import CameraStation, StationKind

if TYPE_CHECKING:
    from robolink.calibration import CameraRound
    from robolink.procedures import TipSource


@dataclass(frozen=True, kw_only=True)
class BoardParameters(LookParameters):
    """How the fiducials of a held board are looked at."""

    fiducials_mm: Annotated[
        tuple[Pair, ...] | None,
        Len(2, 24),
        MM,
        Option(flag="--fiducial", metavar="X,Y", moves=False),
        Help(declared("A fiducial in the axes of the tool; in the order of their numbers.")),
    ] = None
    spacing_mm: Annotated[
        float | None,
        Ge(LEAST_SPACING_MM),
        MM,
        Option(metavar="MM", moves=False),
        Help(
            declared(
                "Two fiducials this far apart: the origin half way, X from 2 to 1 (EPSON's board)."
            )
        ),
    ] = None
    turns_deg: Turns = TWO_ANGLES_DEG

    @property
    def drawing(self) -> BoardDrawing | None:
        """Where the fiducials are on the board, ``None`` while nothing states it."""
        if self.spacing_mm is not None:
            return BoardDrawing.of_two(self.spacing_mm)
        return None if self.fiducials_mm is None else BoardDrawing(self.fiducials_mm)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the drawing is stated once, and that its fiducials can be told apart."""
        yield from super().problems(check)
        if self.spacing_mm is None and self.fiducials_mm is None:
            yield Problem(
                "fiducials_mm",
                tr(
                    "is missing: say where the fiducials are, or give {spacing} for two",
                    spacing=check.spell("spacing_mm"),
                ),
            )
        elif self.fiducials_mm is not None:
            if self.spacing_mm is not None:
                fiducials = check.spell("fiducials_mm")
                yield Problem(
                    "spacing_mm", tr("excludes {other}; give one of them", other=fiducials)
                )
            yield from _apart(self.fiducials_mm)

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty if they can."""
        drawing = self.drawing
        if drawing is None or not drawing.is_pair or len(self.turns_deg) > 1:
            return ""
        return tr(
            "cannot be judged: two fiducials at one angle cannot check each other; "
            "look at two angles or more, or limit the interval and state the standard "
            "deviation"
        )


def _apart(places: Sequence[Pair]) -> Iterator[Problem]:
    for (one, here), (other, there) in combinations(enumerate(places, start=1), 2):
        spacing_mm = math.dist(here, there)
        if spacing_mm < LEAST_SPACING_MM:
            yield Problem(
                f"fiducials_mm#{other}",
                tr(
                    "is {spacing:g} mm from fiducial {one}; it must be at least {limit:g} mm",
                    spacing=spacing_mm,
                    one=one,
                    limit=LEAST_SPACING_MM,
                ),
            )


@checks_arguments
def measure_board(
    station: CameraStation,
    plan: LookPlan,
    board: BoardDrawing,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> "Procedure[CameraRound]":
    """Measure X, Y and U of a held board by its fiducials. Runs in Tool 0.

    Two fiducials at one angle are EPSON's CalcBoardTool; more fiducials or angles leave
    residuals. Over 30 degrees or more of U the camera's own error is told from the board's place.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles each fiducial is looked at.
        board: Where the fiducials are on the board.
        here: Where the flange is.
        stored: The tool of the board, as far as it is known; the fiducials are expected by it.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: ``tilted_pose`` before anything moves; ``fiducial_not_seen``,
            ``several_fiducials_seen``, ``far_off``, ``camera_not_calibrated``,
            ``coincident_fiducials``, ``spacing_mismatch``, and the others of :func:`solve_board`
            and :func:`solve_board_round`.
        LimitError: The arm cannot bring the board before the camera so; nothing was moved.

    Example:
        >>> from robolink.calibration import BoardDrawing
        >>> from robolink.methods import measure_board
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> board, held = BoardDrawing.of_two(40), ToolOffset(2, -1, -20, 8)
        >>> camera, here, plan = CameraStation(300, 80, -30), Pose(300, 100, 20, 0), LookPlan()
        >>> cell = PaperCell(here, held, marks=dict(enumerate(board.seen_from(held), start=1)))
        >>> stored = ToolOffset(0, 0, -20)
        >>> found = cell.run(measure_board(camera, plan, board, here=here, stored=stored))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3), round(found.offset.u_deg, 3)
        (2.0, -1.0, 8.0)
    """
    return BoardSource("", station, board, plan, sigma_mm, retake).procedure(stored, here)


@checks_arguments
def verify_board(
    station: CameraStation,
    plan: LookPlan,
    board: BoardDrawing,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    camera_error_mm: tuple[float, float] = NO_ERROR,
    aside: ToolOffset = NO_OFFSET,
) -> Procedure[VerifyResult]:
    """Turn about the board's new origin and look at its fiducials again. Runs in the new tool.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: Pictures and heights.
        board: Where the fiducials are on the board.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which each fiducial is looked at.
        tolerance_mm: Largest drift that passes.
        camera_error_mm: What the camera is off by, as the measurement found it.
        aside: Where the board is expected, seen from the selected frame.

    Raises:
        CalibrationError: As :func:`measure_board`.

    Example:
        >>> from robolink.calibration import BoardDrawing
        >>> from robolink.methods import verify_board
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import LookPlan
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> board, here = BoardDrawing(((20, 0), (-20, 0))), Pose(300, 80, 0, 0)
        >>> proof = verify_board(
        ...     CameraStation(300, 80, -30), LookPlan(), board, here=here, angles_deg=(0, 90),
        ...     tolerance_mm=0.1,
        ... )
        >>> fiducials = dict(enumerate(board.seen_from(ToolOffset(0.03)), start=1))
        >>> shown = PaperCell(here, ToolOffset(), marks=fiducials).run(proof)
        >>> shown.passed, round(shown.max_drift_mm, 3)
        (True, 0.03)
    """
    drive = CameraDrive(station, plan, here)
    places = _places(board, aside, nearest_first(angles_deg, here))
    return (
        yield from look_again(
            drive, places, here, tolerance_mm=tolerance_mm, camera_error_mm=camera_error_mm
        )
    )


def _places(board: BoardDrawing, tool: ToolOffset, angles_deg: Sequence[float]) -> list[Place]:
    """Return every fiducial at every angle, as something to be looked at."""
    return [
        Place(u_deg, at, mark)
        for u_deg in angles_deg
        for mark, at in enumerate(board.seen_from(tool), start=1)
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardTest(LookTest):
    """A camera's test of a board.

    Attributes:
        board: Where the fiducials are on it.
    """

    method: ClassVar[str] = "board"

    board: BoardDrawing

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        aside = seen_from(self.written, self.tip)
        return verify_board(
            self.station,
            self.plan,
            self.board,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            camera_error_mm=self.camera_error_mm,
            aside=replace(aside, u_deg=self.tip.u_deg - self.written.u_deg),
        )


_TWO_ANGLES = LookPlan(turns_deg=TWO_ANGLES_DEG)


@dataclass(frozen=True, slots=True)
class BoardSource(RoundSource):
    """Measures X, Y and U of a held board by its fiducials.

    Attributes:
        board: Where the fiducials are on the board.
        plan: How they are brought before the camera.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.
    """

    board: BoardDrawing
    plan: LookPlan = field(default=_TWO_ANGLES)
    sigma_mm: float | None = None
    retake: bool = False

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: {count} fiducials of a held board seen by the camera {sensor}",
            count=len(self.board.fiducials_mm),
            sensor=sensor_name(self.sensor),
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the board jump."""
        return tr("Is the board held as drawn? Did the camera find the right marks?")

    def procedure(self, stored: ToolOffset | None, here: Pose) -> "Procedure[CameraRound]":
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        self.board.require_apart()
        return (yield from RoundSource.procedure(self, stored, here))

    def places(self, tool: ToolOffset, angles_deg: Sequence[float]) -> list[Place]:
        """Return every fiducial at every angle."""
        return _places(self.board, tool, angles_deg)

    def expected(self, seen: Sequence[Sighting], stored: ToolOffset | None) -> ToolOffset:
        """Return where the board is, by its first two fiducials."""
        pair = replace(self, board=BoardDrawing(self.board.fiducials_mm[:2]), sigma_mm=None)
        return pair.solved(seen, (1, 2), stored or NO_OFFSET).offset

    def solved(
        self, seen: Sequence[Sighting], marks: Sequence[int], stored: ToolOffset | None
    ) -> "CameraRound":
        """Solve the looks at the fiducials; two of a pair as EPSON's CalcBoardTool does."""
        from robolink.calibration import as_round, solve_board_round  # numpy

        board, camera = self.board, self.station.model
        if len(seen) == 2 and board.is_pair:
            return as_round(
                solve_board(
                    *seen,
                    stored=stored,
                    spacing_mm=math.dist(*board.fiducials_mm),
                    sigma_mm=self.sigma_mm,
                    camera=camera,
                )
            )
        drawing = [board.fiducials_mm[mark - 1] for mark in marks]
        return solve_board_round(
            seen, drawing, stored=stored, sigma_mm=self.sigma_mm, camera=camera
        )

    def proof_of(self, basis: ProofBasis) -> BoardTest:
        """Return the test at other angles; see :class:`~robolink.procedures.ProvesAgain`."""
        return BoardTest(
            **basis.common,
            sensor=self.sensor,
            station=self.station,
            plan=self.plan,
            # The tool's U turned together with the board, so the joint angle is unchanged.
            angles_deg=proof_angles(basis.result, basis.tool),
            camera_error_mm=camera_error_of(basis.result),
            board=self.board,
        )


def board_steps(tool: int) -> tuple[NextStep, ...]:
    """Return the three steps.

    Args:
        tool: Number of the tool that was written.
    """
    return (
        NextStep(
            "select",
            tr("Select tool {tool}, so that positions are those of the board.", tool=tool),
            f"tool select {tool}",
        ),
        NextStep("jog", tr("Jog the board to where it is to be put down."), "robot jog"),
        NextStep(
            "teach",
            tr(
                "Teach that place with tool {tool} selected: on the pendant, or in the program "
                "with the position that this shows.",
                tool=tool,
            ),
            "robot where",
        ),
    )


def _source(parameters: BoardParameters, site: Site) -> "TipSource":
    drawing = parameters.drawing
    assert drawing is not None  # noqa: S101 - the parameters were checked
    sensor, station = camera_at(parameters, site)
    return BoardSource(
        sensor, station, drawing, parameters.look, sigma_mm=site.sigma_mm, retake=parameters.retake
    )


METHOD = Method(
    name="board",
    summary=declared("See the fiducials of a held board: X, Y and U."),
    description=declared(
        "See the fiducials of a held board with an up-looking camera: X, Y and U of the "
        "board.\n\nThe stored tool gives the expected place of the board: with it, each "
        "fiducial must appear in the image by itself. State where they are: the distance "
        "between two, or the place of each."
    ),
    parameters=BoardParameters,
    measures=("x_mm", "y_mm", "u_deg"),
    needs=Needs(station=StationKind.CAMERA, sensor=True, place=PLACE),
    source=_source,
    unmeasured_z=UNMEASURED_Z,
    proof=lambda: BoardTest,
    next_steps=board_steps,
)
