"""Live nozzle changes with a known tip: by every method, on both kinds of controllers.

The real driver and procedures run on a simulator in this process, in virtual time. Errors are put
into a cell after its stations were described, so that no part of robolink is told.
"""

import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, Final

from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.calibration import BoardDrawing, Pin, RowFact, VerifyResult, carrying
from robolink.calibration_run import (
    AcceptanceCriteria,
    ChangePlan,
    Limits,
    Listener,
    NozzleChange,
    Proposal,
    ToolPlan,
)
from robolink.controllers import SoftMotionController
from robolink.errors import RobolinkError, VerifyError
from robolink.methods import (
    Absolute,
    AllRoundPlan,
    AxisTeachPlan,
    BeamsParameters,
    BeamsSource,
    BoardSource,
    CameraAffineSource,
    CameraSource,
    NAngleSource,
    OneTouchSource,
    PivotSource,
    PlaneSurvey,
    PlaneTouchSource,
    PointsSource,
    RunoutTableSource,
    SixPointSource,
    SphereSurvey,
    SphereTouchSource,
    TwoPoseSource,
    ZTouchParameters,
    ZTouchSource,
    informative_tilts,
)
from robolink.model import InputEdge, Pose, ToolOffset, ToolReceipt
from robolink.procedures import LookPlan, TouchPlan
from robolink.runner import Question
from tests.contract._camera_cell import camera_station, furnish
from tests.contract._sensor_cell import PLATE_INPUT, TOOL, plc_sensor_cell, sensor_cell

QUICK: Final = Limits(speed_percent=100, speed_mm_s=2000.0)
"""Faster than commands allow, which only shortens the test."""

BEAM_NOISE: Final = {"noise_mm": 0.003}
PLATE_NOISE: Final = {"noise_mm": 0.002}
PERSON_SIGMA_MM: Final = 0.01
"""The cell's statement about its person: the error of the eye."""

ABOVE_BALL_MM: Final = 15.0
CONTACT: Final = 9
"""The input of the nozzle-and-pin contact, if wired."""


@dataclass(frozen=True)
class Ended:
    """The end of a change.

    Attributes:
        code: The reason of a refusal; empty if the value was written and stays.
        taken_back: Whether it had been written and the old value was restored.
        doubts: The named doubts about a value that stays.
        off_mm: The error of the result, over all measured lengths.
        accurate_mm: The stated accuracy at the end.
        repeatable_mm: The stated repeatability.
        proof: The turn test, with its verdict on the measurement.
        proposal: The proposal.
    """

    code: str = ""
    taken_back: bool = False
    doubts: tuple[str, ...] = ()
    off_mm: float | None = None
    accurate_mm: float | None = None
    repeatable_mm: float | None = None
    proof: VerifyResult | None = field(default=None, repr=False)
    proposal: Proposal | None = field(default=None, repr=False)

    @property
    def good(self) -> bool:
        """Whether the value stays without any doubt."""
        return not self.code and not self.doubts

    @property
    def share(self) -> float:
        """The error as a multiple of the stated accuracy."""
        assert self.off_mm is not None
        assert self.accurate_mm is not None, "it says nothing"
        return self.off_mm / self.accurate_mm


@dataclass(frozen=True)
class Course:
    """A method on a controller, and its cell.

    Attributes:
        method: Its name, with its variant if there are several.
        kind: The kind of controller.
        opened: Sets a cell up, by a seed.
        source: Returns the source of measurements, possibly with random parameters.
        rows: The rows of its budget in which a cell can be wrong.
        proves: Whether there is a turn test.
        approach: Returns the start; ``None`` for the robot's present place.
        truth: The true value for the comparison.
    """

    method: str
    kind: str
    opened: Callable[[int], AbstractContextManager[Any]]
    source: Callable[[Any, random.Random], Any]
    rows: tuple[str, ...] = ()
    proves: bool = True
    approach: Callable[[Any], Pose] | None = None
    truth: Callable[[Any], ToolOffset] = lambda cell: cell.simulator.world.tips[TOOL]

    @property
    def name(self) -> str:
        """Method and kind."""
        return f"{self.method} on {self.kind}"


class Hears(Listener):
    """Keeps the proposal and the turn test, and lets the world change meanwhile."""

    def __init__(self, at_write: Callable[[], None] = lambda: None) -> None:
        self.proposal: Proposal | None = None
        self.proof: VerifyResult | None = None
        self._at_write = at_write

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        """Keep the proposal."""
        (self.proposal,) = proposals

    def wrote(self, receipt: ToolReceipt) -> None:
        """Run the event planned for the write."""
        self._at_write()

    def verified(self, tool: int, result: VerifyResult) -> None:
        """Keep the turn test."""
        self.proof = result


class Person(AssistedOperator):
    """The person of the cell, who answers yes or no by a rule.

    Of several rows they choose the first, unless ``chooses`` names another one by some of its
    words.
    """

    says: Callable[[str], bool] = staticmethod(lambda _question: True)
    chooses: Callable[[], str] = staticmethod(lambda: "")
    asked: list[str]

    def ask(self, question: str, kind: Any) -> None:
        """Keep the question."""
        self.asked = getattr(self, "asked", [])
        self.asked.append(question)
        super().ask(question, kind)

    def poll(self, wait_s: float) -> str | None:
        """Answer it."""
        answer = super().poll(wait_s)
        if answer is not None and self._kind is Question.CHOICE:
            return row_of(self.asked[-1], self.chooses()) or answer
        return "n" if answer == "y" and not self.says(self.asked[-1]) else answer


def row_of(question: str, does: str) -> str:
    """Return the number of the first row with some words; empty for none."""
    rows = [line.split(maxsplit=1) for line in question.splitlines()[1:]]
    return next((number for number, text in rows if does and number.isdigit() and does in text), "")


def person_at(cell: Any) -> Person:
    """Return the person of a cell."""
    eyes = InProcessEyes(cell.simulator)
    found = Person.with_eyes(eyes, lambda _text: None, way_mm=12.0, clock=cell.clock)
    assert isinstance(found, Person)
    return found


def change(
    course: Course,
    seed: int,
    *,
    wrong: Callable[[Any], None] = lambda _cell: None,
    at_write: Callable[[Any], None] = lambda _cell: None,
    attended: bool = False,
    person: Callable[[Any], Person] = person_at,
    interval_mm: float | None = None,
    drift_mm: float = 0.2,
    rows: Mapping[str, float] | None = None,
    role: str = "",
) -> Ended:
    """Change the nozzle in a new cell, and return the end.

    Args:
        course: The method and its cell.
        seed: The seed of the cell and of its errors.
        wrong: Puts errors into the cell after its stations were described.
        at_write: Called while the tool is written.
        attended: Whether a person is asked; otherwise everything is as under ``--yes``.
        person: The person.
        interval_mm: The tip error that the process allows.
        drift_mm: The drift that it allows in a turn test.
        rows: The rows of its budget that the cell states.
        role: The role of the person, if the cell names people.
    """
    with course.opened(seed) as cell:
        source = course.source(cell, random.Random(f"{course.name} {seed}"))
        wrong(cell)
        hears = Hears(lambda: at_write(cell))
        one = ToolPlan(
            TOOL,
            source,
            AcceptanceCriteria(
                interval_mm=interval_mm, drift_tolerance_mm=drift_mm, unattended=not attended
            ),
            approach=None if course.approach is None else course.approach(cell),
            rows={key: RowFact(half, "stated") for key, half in (rows or {}).items()},
        )
        code, taken_back, report = "", False, None
        with robolink.connect(cell.url) as controller:
            if isinstance(controller, SoftMotionController):
                controller.take()
            if role:
                outcomes = controller.outcomes
                outcomes.signature = replace(outcomes.signature, operator="Kim", role=role)
            before = controller.tools.read(TOOL)
            plan = ChangePlan((one,), QUICK, ask_before_write=attended)
            try:
                report = NozzleChange(controller, plan, operator=person(cell), listener=hears).run()
            except RobolinkError as error:
                code, taken_back = named(error), isinstance(error, VerifyError)
                assert controller.tools.same(controller.tools.read(TOOL), before), "not put back"
        return _ended(course, cell, hears, report, code=code, taken_back=taken_back)


def named(error: RobolinkError) -> str:
    """Return the code of an error, or its class if it has none."""
    return str(getattr(error, "code", "") or type(error).__name__)


def _ended(
    course: Course, cell: Any, hears: Hears, report: Any, *, code: str, taken_back: bool
) -> Ended:
    proposal, proof = hears.proposal, hears.proof
    if report is not None:
        proof = report.tools[0].verification or proof
    if proposal is None:
        return Ended(code, taken_back=taken_back)
    found, truth = proposal.result, course.truth(cell)
    off_mm = math.hypot(
        *(
            getattr(found.offset, name) - getattr(truth, name)
            for name in found.measured
            if name.endswith("_mm")
        )
    )
    doubts = (*found.warnings, *(proof.warnings if proof is not None else ()))
    stated_mm = found.accurate_to_mm
    if proof is not None and proof.accurate_to_mm is not None:
        stated_mm = proof.accurate_to_mm
    return Ended(
        code, taken_back, doubts, off_mm, stated_mm, found.repeatable_to_mm, proof, proposal
    )


# Cells.


@contextmanager
def tilting(seed: int, **world: Any) -> Iterator[Any]:
    """Set up a PLC whose flange tilts."""
    simulator, clock = SoftMotionSimulator("Kin_5Axes", seed=seed), ManualClock()
    with served(simulator, clock=clock) as url:
        cell: Any = SimpleNamespace(simulator=simulator, url=url, clock=clock)
        furnish(cell, **world)
        yield cell


@contextmanager
def on_a_plate(seed: int) -> Iterator[Any]:
    """Touch a plane in place of the pin."""
    leaning = {"plane_lean_deg": 20.0, "plane_lean_toward_deg": 30.0}
    with tilting(seed, person_touches="plane", **leaning) as cell:
        yield cell


@contextmanager
def on_a_ball(seed: int) -> Iterator[Any]:
    """Touch a sphere in place of the pin."""
    with tilting(seed, person_touches="sphere") as cell:
        yield cell


def over_the_pin(cell: Any) -> Pose:
    """Return the flange pose with the stored tip straight above the pin."""
    stored = cell.simulator.plc.memory.defined()[TOOL].tool
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    u_deg = cell.simulator.world.robot.flange().u_deg
    return carrying(
        Pose(0, 0, 0, u_deg), ToolOffset(*stored[:3]), (x_mm, y_mm, z_mm + ABOVE_BALL_MM)
    )


KINDS: Final = {"EPSON": sensor_cell, "PLC": plc_sensor_cell}


# Sources.


def stated(rng: random.Random, sigma_mm: float) -> float | None:
    """Return the stated scatter: half the cells state it."""
    return sigma_mm if rng.random() < 0.5 else None


def two_pose(_cell: Any, rng: random.Random) -> Any:
    """Two touches."""
    return TwoPoseSource(sigma_mm=stated(rng, PERSON_SIGMA_MM))


def n_angle(_cell: Any, rng: random.Random) -> Any:
    """Four touches, or six."""
    turns = rng.choice(((90.0, 180.0, 270.0), (60.0, 120.0, 180.0, 240.0, 300.0)))
    return NAngleSource(turns, sigma_mm=stated(rng, PERSON_SIGMA_MM))


def by_input(cell: Any, rng: random.Random) -> Any:
    """Four touches that an input confirms as well."""
    furnish(cell, contact_input=CONTACT)
    touch = TouchPlan(contact=InputEdge(CONTACT))
    sigma_mm = stated(rng, PERSON_SIGMA_MM)
    return NAngleSource((90.0, 180.0, 270.0), touch, sigma_mm=sigma_mm)


def one_touch(cell: Any, _rng: random.Random) -> Any:
    """One touch of a pin at a known place."""
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    pin = Pin(x_mm, y_mm, z_mm, sigma_mm=0.005)
    return OneTouchSource(Absolute(pin, PERSON_SIGMA_MM))


def points(cell: Any, rng: random.Random) -> Any:
    """Poses that a person taught at two angles."""

    def taught() -> list[Pose]:
        simulator, poses = cell.simulator, []
        operator, robot = simulator.world.operator, simulator.world.robot
        # The pendant of an EPSON controller moves the arm in Teach mode only.
        live = hasattr(simulator.panel, "teach")
        if live:
            simulator.panel.teach()
        for turn_deg in (0.0, 180.0):
            robot.turn(turn_deg)
            poses.append(replace(operator.jog_onto_pin(), tool=0))
        if live:
            simulator.panel.auto()
        return poses

    return PointsSource(taught, in_mm=True)


def beams(cell: Any, rng: random.Random, turn_deg: float = 0.0, **plan: Any) -> Any:
    """Two crossed beams."""
    cell.mount_beams(cell.beams(radius_mm=0.1), **BEAM_NOISE)
    return BeamsSource(
        cell.station,
        BeamsParameters(turn_deg=turn_deg, repeats=rng.choice((2, 3)), **plan),
    )


def beams_once(cell: Any, rng: random.Random) -> Any:
    """Two crossed beams, once around them: the procedure of the shipped recipe."""
    cell.mount_beams(cell.beams(radius_mm=0.1), **BEAM_NOISE)
    plan = BeamsParameters(repeats=1, test_turn_deg=90.0, crossing_mm_s=8.0, aside_mm=2.1)
    return BeamsSource(cell.station, plan)


def beams_turned(cell: Any, rng: random.Random) -> Any:
    """The same at two angles."""
    return beams(cell, rng, rng.choice((90.0, 180.0)))


def z_touch(cell: Any, _rng: random.Random) -> Any:
    """A plate that switches."""
    cell.mount_plate(**PLATE_NOISE)
    return ZTouchSource(cell.plate)


def z_touch_quick(cell: Any, _rng: random.Random) -> Any:
    """The same, tested by one touch: as the shipped recipe does."""
    cell.mount_plate(**PLATE_NOISE)
    plan = ZTouchParameters(test_speeds_mm_s=(2.0,), clearance_mm=2.5, back_off_mm=0.3, lift_mm=4.0)
    return ZTouchSource(cell.plate, plan)


def camera(cell: Any, _rng: random.Random) -> Any:
    """A camera, at four angles."""
    return CameraSource(cell.url, camera_station(cell))


def camera_quick(cell: Any, _rng: random.Random) -> Any:
    """A camera, at four angles of less than a third of a turn: as the shipped recipe looks."""
    plan = LookPlan(turns_deg=(0.0, 32.0, 64.0, 96.0), lift_mm=2.0, beside_mm=0.7)
    return CameraSource(cell.url, camera_station(cell), plan, test_turns_deg=(90.0,))


def camera_one_look(cell: Any, _rng: random.Random) -> Any:
    """A camera, at one."""
    return CameraSource(cell.url, camera_station(cell), LookPlan(turns_deg=(0.0,)))


def camera_affine(cell: Any, _rng: random.Random) -> Any:
    """A camera without a calibration."""
    return CameraAffineSource(cell.url, camera_station(cell, known=False))


def runout_table(cell: Any, rng: random.Random) -> Any:
    """A camera that looks at a tip with runout all round."""
    turns = tuple(30.0 * step for step in range(12))
    furnish(cell, wobble_mm=rng.uniform(0, 0.06), wobble_toward_deg=rng.uniform(0, 360))
    return RunoutTableSource(cell.url, camera_station(cell), AllRoundPlan(turns_deg=turns))


def board(cell: Any, rng: random.Random) -> Any:
    """A held board with two fiducials or four."""
    furnish(cell, board_held=True)
    drawing = BoardDrawing(cell.simulator.world.board.drawing_mm[: rng.choice((2, 4))])
    return BoardSource(cell.url, camera_station(cell), drawing)


def held_board(cell: Any) -> ToolOffset:
    """Return the place of the board."""
    world = cell.simulator.world
    frame: ToolOffset = world.board.frame(world.tips[TOOL])
    return frame


def pivot(_cell: Any, rng: random.Random) -> Any:
    """A pin touched by a tilted tool."""
    count_ = rng.choice((4, 6))
    return PivotSource(informative_tilts(count_, 20.0), sigma_mm=stated(rng, PERSON_SIGMA_MM))


def six_point(_cell: Any, rng: random.Random) -> Any:
    """The same, with its axes shown."""
    return SixPointSource(
        informative_tilts(4, 20.0),
        sigma_mm=stated(rng, PERSON_SIGMA_MM),
        ways=AxisTeachPlan(10.0),
    )


def plane_touch(_cell: Any, rng: random.Random) -> Any:
    """A plane."""
    return PlaneTouchSource(TouchPlan(lift_mm=15.0), PlaneSurvey(rng.choice((10, 12))), axes=5)


def sphere_touch(_cell: Any, _rng: random.Random) -> Any:
    """A sphere."""
    return SphereTouchSource(TouchPlan(lift_mm=15.0), SphereSurvey(10.0, 12), axes=5)


_SEEN: Final = ("tip_image_px", "camera_turn_deg", "camera_scale_percent")

COURSES: Final[tuple[Course, ...]] = (
    *(
        course
        for kind, opened in KINDS.items()
        for course in (
            Course("two-pose", kind, opened, two_pose, ("touch_mm",)),
            Course("n-angle", kind, opened, n_angle, ("touch_mm",)),
            Course("n-angle, contact input", kind, opened, by_input),
            Course("one-touch", kind, opened, one_touch, ("touch_mm", "place_mm")),
            Course("points", kind, opened, points, ("touch_mm",), proves=False),
            Course("beams", kind, opened, beams, ("place_mm", "bend_deg")),
            Course("beams once", kind, opened, beams_once, ("place_mm", "bend_deg")),
            Course("beams --turn", kind, opened, beams_turned, ("place_mm", "bend_deg")),
            Course("z-touch", kind, opened, z_touch, ("plate_mm",)),
            Course("z-touch, quick", kind, opened, z_touch_quick, ("plate_mm",)),
            Course("camera", kind, opened, camera, (*_SEEN, "place_mm")),
            Course("camera, quick", kind, opened, camera_quick, (*_SEEN, "place_mm")),
            Course("camera, one look", kind, opened, camera_one_look, (*_SEEN, "place_mm")),
            Course("camera-affine", kind, opened, camera_affine, ("tip_image_px",)),
            Course("runout-table", kind, opened, runout_table, (*_SEEN, "place_mm")),
            Course(
                "board",
                kind,
                opened,
                board,
                ("camera_turn_deg", "camera_scale_percent", "print_mm", "place_mm"),
                truth=held_board,
            ),
        )
    ),
    Course("pivot", "PLC", tilting, pivot, ("touch_mm",)),
    Course("six-point", "PLC", tilting, six_point, ("touch_mm",)),
    Course("plane-touch", "PLC", on_a_plate, plane_touch, ("touch_mm",)),
    Course("sphere-touch", "PLC", on_a_ball, sphere_touch, ("touch_mm",), approach=over_the_pin),
)

BY_NAME: Final[Mapping[str, Course]] = {course.name: course for course in COURSES}


# What is wrong.


def wrong_by(rows: Mapping[str, tuple[float, ...]]) -> Callable[[Any], None]:
    """Return a function that makes a cell wrong by this much in each row, in the unit of the row.

    Args:
        rows: X and Y for each row in the plane, one number for each other; for ``print_mm`` X and Y
            of each fiducial in turn; for ``bend_deg`` the angle and its direction.
    """

    def put_in(cell: Any) -> None:
        for key, by in rows.items():
            _WRONG[key](cell, *by)

    return put_in


def _polar(x: float, y: float) -> tuple[float, float]:
    return math.hypot(x, y), math.degrees(math.atan2(y, x))


def _touch(cell: Any, x_mm: float, y_mm: float) -> None:
    beside_mm, toward_deg = _polar(x_mm, y_mm)
    furnish(
        cell,
        person_bias_mm=beside_mm,
        person_bias_frame="tool",
        person_bias_toward_deg=toward_deg % 360.0,
    )


def _place(cell: Any, x_mm: float, y_mm: float) -> None:
    """Shift everything that a method could rely on."""
    world = cell.simulator.world
    moved_mm, toward_deg = _polar(x_mm, y_mm)
    furnish(cell, beams_moved_mm=moved_mm, beams_moved_toward_deg=toward_deg % 360.0)
    for one in (world, world.camera):
        name = "pin_mm" if one is world else "middle_mm"
        x, y, z = getattr(one, name)
        setattr(one, name, (x + x_mm, y + y_mm, z))


def _camera_turn(cell: Any, by_deg: float) -> None:
    furnish(cell, camera_turn_deg=cell.simulator.world.parameters.camera_turn_deg + by_deg)


def _camera_scale(cell: Any, percent: float) -> None:
    said = cell.simulator.world.parameters
    # What is larger in the image is told as longer: a pixel is shorter than it was.
    by = 1 / (1 + percent / 100)
    furnish(
        cell,
        camera_um_per_px_x=said.camera_um_per_px_x * by,
        camera_um_per_px_y=said.camera_um_per_px_y * by,
    )


def _tip_image(cell: Any, x_px: float, y_px: float) -> None:
    beside_px, toward_deg = _polar(x_px, y_px)
    furnish(cell, camera_tip_beside_px=beside_px, camera_tip_beside_toward_deg=toward_deg % 360.0)


def _plate(cell: Any, z_mm: float) -> None:
    world = cell.simulator.world
    world.connect(PLATE_INPUT, TouchPlate(cell.plate.z_mm + z_mm), **PLATE_NOISE)


def _bend(cell: Any, lean_deg: float, toward_deg: float) -> None:
    furnish(cell, lean_deg=lean_deg, lean_toward_deg=toward_deg)


def _print(cell: Any, *beside_mm: float) -> None:
    world = cell.simulator.world
    drawn = world.board.drawing_mm
    by = list(zip(beside_mm[::2], beside_mm[1::2], strict=True))
    printed = tuple((x + dx, y + dy) for (x, y), (dx, dy) in zip(drawn, by, strict=True))
    world.board = replace(world.board, drawing_mm=printed)


_WRONG: Final[Mapping[str, Callable[..., None]]] = {
    "touch_mm": _touch,
    "place_mm": _place,
    "camera_turn_deg": _camera_turn,
    "camera_scale_percent": _camera_scale,
    "tip_image_px": _tip_image,
    "plate_mm": _plate,
    "bend_deg": _bend,
    "print_mm": _print,
}


def slips(dx_mm: float, dy_mm: float, dz_mm: float = 0.0) -> Callable[[Any], None]:
    """Return a function that makes the nozzle slip in its mount, in the axes of the tool."""

    def slip(cell: Any) -> None:
        tips = cell.simulator.world.tips
        tip = tips[TOOL]
        tips[TOOL] = replace(
            tip, x_mm=tip.x_mm + dx_mm, y_mm=tip.y_mm + dy_mm, z_mm=tip.z_mm + dz_mm
        )

    return slip
