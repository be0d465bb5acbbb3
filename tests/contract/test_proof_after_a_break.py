"""Each method with a turn test can run it after a break, and fails it if the tip slipped.

The link is cut after the write and before the turn test. The next run finds the change open, with
the test in the durable record, and carries it out.
"""

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.media import served

import robolink
from robolink.calibration import BoardDrawing, Pin
from robolink.calibration_run import (
    ChangePlan,
    Listener,
    NozzleChange,
    ToolPlan,
    finish_by_turn_test,
    open_turn_tests,
    untested_sentences,
)
from robolink.errors import ConfigError, RobolinkError, VerifyError
from robolink.journal import open_journal
from robolink.methods import (
    Absolute,
    AllRoundPlan,
    AxisTeachPlan,
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
from robolink.model import EntryKind, MarkerKind, Pose
from robolink.procedures import LazySource, TouchPlan
from robolink.sensing import open_sensor
from robolink.transaction import recover
from tests.contract._camera_cell import camera_station, furnish
from tests.contract._sensor_cell import TOOL, sensor_cell
from tests.contract.test_calibrate_pivot import FIVE, QUICK
from tests.contract.test_calibrate_surfaces import LEANING
from tests.faults._what_stands import commits

pytestmark = pytest.mark.simulator_only

ON_A_SURFACE = TouchPlan(lift_mm=15.0)
TILTS = informative_tilts(4, 20.0)


@contextmanager
def tilting(world=None):
    simulator, clock = SoftMotionSimulator(FIVE, seed=4, world=world), ManualClock()
    with served(simulator, clock=clock) as url:
        yield SimpleNamespace(simulator=simulator, url=url, clock=clock)


@contextmanager
def on_a_ball():
    with tilting(WorldParameters(person_touches="sphere")) as cell:
        yield cell


@contextmanager
def on_a_plate():
    with tilting(LEANING) as cell:
        yield cell


@contextmanager
def with_switches():
    with sensor_cell() as cell:
        cell.mount_beams(cell.beams())
        cell.mount_plate()
        yield cell


@contextmanager
def with_a_board():
    with sensor_cell() as cell:
        furnish(cell, board_held=True)
        yield cell


@contextmanager
def wobbling():
    with sensor_cell() as cell:
        furnish(cell, wobble_mm=0.12, wobble_toward_deg=40.0)
        yield cell


def runout(cell):
    plan = AllRoundPlan(turns_deg=tuple(30.0 * step for step in range(12)))
    return RunoutTableSource(cell.url, camera_station(cell), plan)


def one_touch(cell):
    x_mm, y_mm, z_mm = cell.simulator.world.pin_mm
    pin = Pin(x_mm, y_mm, z_mm, sigma_mm=0.01)
    return LazySource(
        lambda: OneTouchSource(Absolute(pin, 0.02)), sentence="one touch", clearance_mm=5.0
    )


def board(cell):
    drawing = BoardDrawing(cell.simulator.world.board.drawing_mm)
    return BoardSource(cell.url, camera_station(cell), drawing)


@dataclass(frozen=True)
class Case:
    """A cell and its measurement; ``slip`` is the axis along which the tip moves after it."""

    cell: Callable[[], Any]
    source: Callable[[Any], Any]
    slip: str = "x_mm"
    approach: Pose | None = None


CASES = {
    "two-pose": Case(sensor_cell, lambda _cell: TwoPoseSource()),
    "n-angle": Case(sensor_cell, lambda _cell: NAngleSource((120.0, 240.0))),
    "one-touch": Case(sensor_cell, one_touch),
    "pivot": Case(tilting, lambda _cell: PivotSource(TILTS)),
    "six-point": Case(tilting, lambda _cell: SixPointSource(TILTS, ways=AxisTeachPlan(10.0))),
    "plane-touch": Case(
        on_a_plate, lambda _cell: PlaneTouchSource(ON_A_SURFACE, PlaneSurvey(10), axes=5), "z_mm"
    ),
    "sphere-touch": Case(
        on_a_ball,
        lambda _cell: SphereTouchSource(ON_A_SURFACE, SphereSurvey(10.0, 12), axes=5),
        "z_mm",
        Pose(53.4, 51.5, -30.0, 72.0),
    ),
    "camera": Case(sensor_cell, lambda cell: CameraSource(cell.url, camera_station(cell))),
    "camera-affine": Case(
        sensor_cell, lambda cell: CameraAffineSource(cell.url, camera_station(cell, known=False))
    ),
    "runout-table": Case(wobbling, runout),
    "board": Case(with_a_board, board, ""),
    "beams": Case(with_switches, lambda cell: BeamsSource(cell.station)),
    "z-touch": Case(with_switches, lambda cell: ZTouchSource(cell.plate), "z_mm"),
    "camera, one test angle": Case(
        sensor_cell,
        lambda cell: CameraSource(cell.url, camera_station(cell), test_turns_deg=(90.0,)),
    ),
    "z-touch, one touch": Case(
        with_switches,
        lambda cell: ZTouchSource(cell.plate, ZTouchParameters(test_speeds_mm_s=(2.0,))),
        "z_mm",
    ),
}
EACH_TIME = ("one-touch", "camera", "z-touch", "z-touch, one touch")


class Cuts(Listener):
    """Ends everything when the last value is written: nothing is sent, nothing is recorded."""

    gone = False

    def __init__(self, cell, last):
        self._cell, self._last = cell, last

    def wrote(self, receipt):
        if receipt.tool == self._last:
            self.gone = True
            self._cell.simulator.panel.cut_link()


class Later:
    """One cell, its record, and its users."""

    def __init__(self, cell, folder):
        self.cell = cell
        self.journal = open_journal(str(folder / "journal.db"))
        self.asked: list[str] = []

    @contextmanager
    def connected(self):
        log = self.journal.log(self.cell.url, clock=self.cell.clock)
        with robolink.connect(self.cell.url, outcomes=log) as controller:
            yield controller

    def person(self):
        later = self

        class Person(AssistedOperator):
            def ask(self, question, kind):
                later.asked.append(question)
                super().ask(question, kind)

        eyes = InProcessEyes(self.cell.simulator)
        return Person.with_eyes(eyes, lambda _text: None, way_mm=12.0, clock=self.cell.clock)

    def broken_off(self, *sources, approach=None, verify=True):
        """Measure and write, with one source for each tool; then the link is cut."""
        tools = tuple(
            ToolPlan(tool, source, approach=approach, verify=verify)
            for tool, source in enumerate(sources, start=TOOL)
        )
        plan = ChangePlan(tools, QUICK, ask_before_write=False)
        cuts = Cuts(self.cell, len(sources))
        with (
            commits(lambda _number: cuts.gone),
            pytest.raises((RobolinkError, ConfigError)),
            self.connected() as controller,
        ):
            NozzleChange(controller, plan, operator=self.person(), listener=cuts).run()
        assert cuts.gone
        self.asked.clear()
        self.cell.clock.sleep(60.0)

    def finished(self, controller):
        """Run the open turn test; return the person with the questions asked."""
        (operation,) = open_turn_tests(controller)
        recover(controller, keep=True, confirm=lambda _finding: True, later=[operation])
        finish_by_turn_test(controller, operation, self.person())

    def verified(self):
        log = self.journal.log(self.cell.url, clock=self.cell.clock)
        return [one.details["passed"] for one in log.recorded(kinds=(EntryKind.VERIFY,))]


def soaked(method):
    return pytest.param(method, marks=() if method in EACH_TIME else pytest.mark.soak)


@pytest.mark.parametrize("method", [soaked(name) for name in CASES])
def test_the_proof_that_was_cut_off_is_made_and_the_value_stays(method, tmp_path):
    case = CASES[method]
    with case.cell() as cell:
        later = Later(cell, tmp_path)
        later.broken_off(case.source(cell), approach=case.approach)
        with later.connected() as controller:
            new = controller.tools.read(TOOL)
            (tests,) = open_turn_tests(controller).values()
            here = controller.groups[0].pose()
            assert tests[0].test.moves(here) >= 3
            assert untested_sentences(controller) == []
            later.finished(controller)
            assert controller.tools.read(TOOL) == new
            assert controller.outcomes.open_markers() == ()
        assert later.verified() == [True]
        assert bool(later.asked) is tests[0].test.by_touch


@pytest.mark.parametrize(
    "method",
    [
        pytest.param(name, marks=() if name == "one-touch" else pytest.mark.soak)
        for name, case in CASES.items()
        if case.slip
    ],
)
def test_a_tip_that_slipped_meanwhile_gets_its_old_value_back(method, tmp_path):
    case = CASES[method]
    with case.cell() as cell:
        later = Later(cell, tmp_path)
        with later.connected() as controller:
            old = controller.tools.read(TOOL)
        later.broken_off(case.source(cell), approach=case.approach)
        tip = cell.simulator.world.tips[TOOL]
        off = replace(tip, **{case.slip: getattr(tip, case.slip) + 0.8})
        cell.simulator.world.tips[TOOL] = off
        with later.connected() as controller:
            with pytest.raises(VerifyError):
                later.finished(controller)
            assert controller.tools.same(controller.tools.read(TOOL), old)
            assert controller.outcomes.open_markers() == ()
        assert later.verified() == [False]


def taught(tool):
    x_mm, y_mm = (298.0, 322.0), (99.0, 91.0)
    poses = [Pose(x, y, -60.0, u, tool=0) for x, y, u in zip(x_mm, y_mm, (0.0, 180.0), strict=True)]
    return PointsSource(lambda: [replace(pose, y_mm=pose.y_mm + tool) for pose in poses])


@pytest.mark.parametrize(
    ("sources", "verify", "sentence"),
    [
        (
            lambda _cell, _eye: (taught(0), taught(0)),
            True,
            (
                "Tool 2 was measured from existing poses: nothing moves, so there is no turn "
                "test. When this job is finished or undone, 'robolink calibrate two-pose' "
                "measures and tests the tool."
            ),
        ),
        pytest.param(
            lambda _cell, _eye: (TwoPoseSource(), TwoPoseSource()),
            False,
            "Tool 2 was written without a turn test, as requested. When this job is "
            "finished or undone, 'robolink calibrate two-pose' measures and tests the tool.",
            marks=pytest.mark.soak,
        ),
        (
            lambda cell, eye: (CameraSource(eye, camera_station(cell)),),
            True,
            (
                "The camera that measured tool 1 was opened by another program: robolink "
                "cannot open it. When this job is finished or undone, 'robolink calibrate "
                "camera' measures and tests the tool."
            ),
        ),
    ],
    ids=["taught points", "no test", "an open camera"],
)
def test_where_no_proof_can_be_made_it_is_said_why_and_what_does(
    sources, verify, sentence, tmp_path
):
    with sensor_cell() as cell, open_sensor(cell.url) as eye:
        later = Later(cell, tmp_path)
        later.broken_off(*sources(cell, eye), verify=verify)
        with later.connected() as controller:
            assert any(m.kind is MarkerKind.CHANGE for m in controller.outcomes.open_markers())
            assert open_turn_tests(controller) == {}
            assert untested_sentences(controller)[-1] == sentence
