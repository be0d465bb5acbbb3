"""The inputs of a measurement: the flange, the last touch, a paper cell, former names."""

import math
from dataclasses import replace
from typing import Any

import pytest

from robolink.calibration import (
    NeedleChain,
    NeedleLimits,
    Pin,
    carrying,
    solve_n_angle,
    solve_two_pose,
)
from robolink.calibration_run import Limits, Proposal
from robolink.calibration_run._records import touch_details
from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import CalibrationError, DeclinedError
from robolink.methods import (
    Absolute,
    Difference,
    LastTouch,
    NAngleSource,
    OneTouchSource,
    TwoPoseSource,
    difference_from_last,
    find_last_touch,
    find_method,
    measure_camera,
    measure_two_pose,
    method_names,
)
from robolink.methods.method import Site
from robolink.model import (
    EntryKind,
    InputEdge,
    NewEntry,
    Path,
    Pose,
    ToolOffset,
    finding_named_now,
    method_name_now,
    plain_offset,
    with_method_name_now,
)
from robolink.model import _journal_entries as former
from robolink.procedures import LookPlan, MeasurementContext, TouchPlan
from robolink.runner import Ask, Confirm, Look, Move, Notify, Seek, TeachPrompt, TouchedAt
from robolink.stations import CameraStation, Station, StationKind
from robolink.testing import PaperCell
from tests._rows import each_row

# The reference for one touch of the next nozzle, and the result of a wrong answer.

HERE = Pose(330.0, 120.0, 20.0, 0.0, tool=0)
STORED = ToolOffset(12.0, -4.0, -20.0)
OTHER = ToolOffset(5.0, 6.0, -30.0)
PIN = (310.0, 95.0, -40.0)


def kept(tool=1, station="PIN-07", value=STORED, **said: Any):
    """Return the journal entry of a kept calibration."""
    touch = {
        "station": station, "x_mm": PIN[0], "y_mm": PIN[1], "z_mm": PIN[2], "u_deg": 90.0,
        "sigma_mm": 0.03, "changes": 3, "full_sigma_mm": 0.01, "touch_sigma_mm": 0.02,
    }  # fmt: skip
    details = {"touch": touch | said, "value": plain_offset(value)}
    return NewEntry(EntryKind.DONE, tool=tool, details=details)


@pytest.fixture
def controller():
    with SimpleController(SimpleMachine({1: STORED, 2: OTHER})) as controller:
        yield controller


def test_the_newest_touch_of_this_tool_on_this_pin_is_what_counts(controller):
    controller.outcomes.append(kept(x_mm=300.0), kept())
    controller.outcomes.append(kept(station="PIN-08", x_mm=200.0))
    controller.outcomes.append(kept(tool=2, value=OTHER, x_mm=100.0))
    last = find_last_touch(controller, 1, "PIN-07")
    assert last.place_mm == PIN
    assert last.u_deg == 90.0
    assert last.chain == NeedleChain(0.03, 3, 0.01)
    for tool, station in ((2, "PIN-08"), (1, "PIN-09")):
        with pytest.raises(CalibrationError) as refused:
            find_last_touch(controller, tool, station)
        assert refused.value.code == "no_last_touch"


def test_a_touch_that_belongs_to_another_value_is_refused(controller):
    controller.outcomes.append(kept())
    controller.tools.write(1, replace(STORED, y_mm=-4.01), expected=STORED)
    with pytest.raises(CalibrationError) as refused:
        find_last_touch(controller, 1, "PIN-07")
    assert refused.value.code == "reference_outdated"


def test_a_stated_scatter_counts_before_that_of_the_last_touch(controller):
    controller.outcomes.append(kept())
    for stated, used in ((0.05, 0.05), (None, 0.02)):
        solver = difference_from_last(
            controller, 1, "PIN-07", sigma_mm=stated, limits=NeedleLimits()
        )
        assert solver.sigma_mm == used


@each_row(("full_mm", "changes"), [(0.03, 3), (0.03, 0), (0.08, 0), (0.08, 4)])
def test_how_many_changes_are_left_is_what_the_changes_themselves_say(full_mm, changes):
    limits, sigma_mm = NeedleLimits(tolerance_mm=0.1, max_changes=6), 0.02
    chain = NeedleChain(math.hypot(full_mm, sigma_mm) if changes else full_mm, changes, full_mm)
    left, made, place = (
        chain.changes_left(math.sqrt(2) * sigma_mm, limits, shared_touch=True),
        0,
        PIN,
    )
    due = bool(changes) and chain.is_due(limits)
    while not due:
        last = LastTouch("PIN-07", place, 90.0, STORED, chain, sigma_mm, nozzle="", at="")
        result: Any = Difference(last, sigma_mm, limits).solve([Pose(298, 99, -20, 0)], STORED)
        chain, due, made = result.chain, result.full_calibration_due, made + 1
    assert left == made


LAST = LastTouch(
    "PIN-07", PIN, 90.0, STORED, NeedleChain(0.03, 3, 0.01), 0.02, nozzle="", at="", touches=4
)


def at_last(tip, u_deg=90.0):
    """Return the flange pose of a touch of the pin."""
    cell = PaperCell(replace(HERE, u_deg=u_deg), tip, PIN)
    steps = OneTouchSource(Absolute(Pin(*PIN), 0.02)).procedure(tip, cell.here)
    return cell.run(steps).inputs[-1]


@pytest.mark.parametrize(("tolerance_mm", "due"), [(0.1, False), (0.05, True)])
def test_a_difference_carries_what_two_touches_scatter_however_many_came_before(tolerance_mm, due):
    limits = NeedleLimits(tolerance_mm=tolerance_mm)
    solver: Any = Difference(LAST, 0.02, limits)
    found = solver.solve([at_last(replace(STORED, x_mm=12.3))], STORED)
    assert found.offset.components()[:3] == pytest.approx((12.3, -4.0, -20.0))
    # u^2 = u0^2 + 2 s^2: the touches between cancel (docs/reference/evidence.md 12).
    assert found.sigma_mm == pytest.approx(0.02)
    assert found.chain.sigma_mm == pytest.approx(math.hypot(0.01, math.sqrt(2) * 0.02))
    assert found.chain.changes == 4
    assert found.full_calibration_due is due


@pytest.mark.parametrize(("solver", "u_deg"), [
    (Difference(LAST, 0.02, NeedleLimits()), 90.0),
    (Absolute(Pin(*PIN), 0.02), 0.0),
])  # fmt: skip
def test_the_tip_comes_down_over_the_pin_at_the_u_of_the_last_touch(solver, u_deg):
    """With runout, another U would show another tip."""
    source = OneTouchSource(solver)
    cell = PaperCell(HERE, STORED, PIN)
    course: Any = source.procedure(STORED, HERE)
    cell.run(course)
    (ask,) = (step for step in cell.steps if isinstance(step, Ask))
    assert ask.foreseen
    assert ask.foreseen.u_deg == u_deg
    moves = [step for step in cell.steps if isinstance(step, Move)]
    beside_mm = (12.0, -4.0) if u_deg == 0.0 else (4.0, 12.0)  # of the tip, base
    for move in moves:
        height_mm = move.target.z_mm - 20.0 - PIN[2]
        assert height_mm >= (source.clearance_mm if move.path is Path.STRAIGHT else 10.0)
    tip = ask.foreseen.x_mm + beside_mm[0], ask.foreseen.y_mm + beside_mm[1]
    assert tip == pytest.approx(PIN[:2])


@pytest.mark.parametrize("pin_sigma_mm", [None, 0.03])
def test_a_tip_is_as_sure_as_its_pin(pin_sigma_mm, controller):
    """Relative to a pin, the interval is unknown if nobody stated the pin's accuracy."""
    method, site = find_method("one-touch"), site_at(controller, sigma_mm=pin_sigma_mm)
    source: Any = method.source(method.parameters(basis="absolute", clearance_mm=4.0), site)
    found = PaperCell(HERE, STORED, PIN).run(source.procedure(STORED, HERE))
    assert (found.half_width95 == ()) is (pin_sigma_mm is None)
    assert source.clearance_mm == 4.0, "it is compared with the largest change before it begins"
    assert source.can_add_touch is False, "the touch can be made again, and none added"


def test_touches_that_only_their_residuals_judge_are_recorded_as_less_sure_than_those():
    around = [carrying(Pose(0, 0, 0, u_deg), STORED, PIN) for u_deg in (0, 120, 240)]
    bent = [replace(around[0], x_mm=around[0].x_mm + 0.02), *around[1:]]
    result = solve_n_angle(bent)
    recorded: Any = touch_details("PIN-07", Proposal(1, STORED, result))["touch_sigma_mm"]
    assert result.sigma_mm is not None
    # Of three touches one number is to spare: Student's t for a 95 % interval is 12.7, not 1.96.
    assert recorded > 2 * result.sigma_mm


def site_at(controller, **pin):
    x_mm, y_mm, z_mm = PIN
    station = Station(id="PIN-07", kind=StationKind.PIN, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm, **pin)
    return Site(controller=controller, tool=1, station=station, sigma_mm=0.02, max_change_mm=0.5)


def test_a_difference_beyond_the_largest_change_of_the_site_is_refused(controller):
    controller.outcomes.append(kept())
    method = find_method("one-touch")
    source: Any = method.source(method.parameters(), site_at(controller))

    def touched(tip):
        return PaperCell(HERE, tip, PIN).run(source.procedure(STORED, HERE))

    assert touched(replace(STORED, x_mm=12.4)).offset.x_mm == pytest.approx(12.4)
    with pytest.raises(CalibrationError):
        touched(replace(STORED, x_mm=12.6))


# The paper cell: its answers follow from the tip's place alone.

PAPER_TIP = Pose(300.0, 100.0, 20.0, 90.0, tool=0)
TIP = ToolOffset(12.0, -4.0, -20.0)


def answers(*steps):
    """Return the answer to each step, or the code of its refusal."""
    heard = []
    for step in steps:
        try:
            heard.append((yield step))
        except CalibrationError as error:
            heard.append(error.code)
    return heard


def down(number, *, falling=False):
    """Seek from the tip's place to 10 mm below."""
    target = Pose(300.0, 100.0, 10.0, 90.0, tool=0)
    return Seek(target, InputEdge(number, falling=falling), 2.0, "down")


def test_a_touch_brings_the_tip_to_the_pin_without_turning_the_tool():
    (touch,) = PaperCell(PAPER_TIP, TIP, (310.0, 95.0, -40.0)).run(answers(Ask("touch")))
    assert isinstance(touch, TouchedAt)
    # At U = 90 the tip's X lies along the base's Y, and its Y against the base's X.
    assert touch.coordinates() == pytest.approx((306.0, 83.0, -20.0, 90.0, 0.0, 0.0))
    assert touch.seconds == 4.0
    assert touch.contact is None


def test_a_contact_input_is_seen_to_switch():
    cell = PaperCell(PAPER_TIP, TIP, (310.0, 95.0, -40.0))
    (touch,) = cell.run(answers(Ask("touch", contact=InputEdge(2))))
    assert touch.contact is True


@pytest.mark.parametrize("contact", [None, InputEdge(2)])
def test_a_touch_that_nobody_describes_is_not_made(contact):
    cell = PaperCell(PAPER_TIP, TIP)
    with pytest.raises(CalibrationError) as refused:
        cell.run(measure_two_pose(TouchPlan(contact=contact), stored=TIP))
    assert refused.value.code == "not_touched"


def test_a_surface_is_touched_where_the_person_comes_from():
    cell = PaperCell(PAPER_TIP, TIP, lambda at: (at[0], at[1], -40.0))
    (touch,) = cell.run(answers(Ask("touch")))
    assert touch.coordinates()[:3] == pytest.approx((300.0, 100.0, -20.0))


def test_an_edge_is_found_where_the_switch_goes_over():
    cell = PaperCell(PAPER_TIP, TIP, switches={5: lambda at: at[2] < -4.321})
    (found,) = cell.run(answers(down(5)))
    assert found.z_mm == pytest.approx(15.679, abs=1e-9)
    assert cell.here == found


@each_row(
    ("number", "falling", "code", "stands_mm"),
    [(5, False, "edge_passed", 20.0), (6, False, "no_edge", 10.0), (6, True, "edge_passed", 20.0)],
)
def test_an_edge_that_does_not_come_is_refused_as_at_a_robot(number, falling, code, stands_mm):
    cell = PaperCell(PAPER_TIP, TIP, switches={5: lambda _at: True})
    assert cell.run(answers(down(number, falling=falling))) == [code]
    assert cell.here.z_mm == stands_mm


def test_a_mark_that_is_not_there_is_not_seen():
    camera = CameraStation(300.0, 80.0, -30.0)
    cell = PaperCell(PAPER_TIP, TIP, marks={})
    assert cell.run(answers(Look("see", (0.0, 0.0)))) == ["tip_not_seen"]
    with pytest.raises(CalibrationError) as refused:
        cell.run(measure_camera(camera, LookPlan(), here=PAPER_TIP, stored=TIP))
    assert refused.value.code == "tip_not_seen"


def test_axes_are_shown_as_the_tip_has_them():
    cell = PaperCell(PAPER_TIP, ToolOffset(12.0, -4.0, -20.0, u_deg=-90.0))
    (along,) = cell.run(answers(Ask("go", TeachPrompt.ALONG_X)))
    assert along.coordinates()[:3] == pytest.approx((360.0, 100.0, 20.0))


def test_what_was_asked_told_and_offered_is_kept():
    cell = PaperCell(PAPER_TIP, TIP)
    target = Pose(1.0, 2.0, 3.0, 4.0)
    heard = cell.run(answers(Move(target, Path.JOINT, "go"), Notify("well"), Confirm("again?")))
    assert heard == [target, None, False]
    assert cell.told == ["well"]
    assert [type(step).__name__ for step in cell.steps] == ["Move", "Notify", "Confirm"]


# Whatever tool is selected, a measurement moves the flange and reports its poses.

SOURCES: dict[str, Any] = {
    "two-pose": TwoPoseSource(),
    "n-angle": NAngleSource((120.0, 240.0)),
    "one-touch": OneTouchSource(Absolute(Pin(310.0, 0.0, 60.0), 0.02)),
}


class Leaves:
    """Notes the selected tool at a question, and leaves."""

    def __init__(self, controller):
        self.selected = []
        self._controller = controller

    def tell(self, text):
        pass

    def ask(self, question, kind):
        self.selected.append(self._controller.tools.selected())

    def poll(self, wait_s):
        return "q"


@each_row("method", SOURCES)
def test_tool_zero_is_selected_before_a_touch_is_asked_for(method):
    source = SOURCES[method]
    with SimpleController(SimpleMachine({1: STORED})) as controller:
        start = controller.groups[0].pose()
        cell = PaperCell(Pose(*start.coordinates(), tool=0), STORED, (310.0, 0.0, 60.0))
        result = cell.run(source.procedure(STORED, cell.here))
        person = Leaves(controller)
        context = MeasurementContext(controller, person, start=start, settings=Limits().settings)
        for again in (None, 0):
            for steps in (
                lambda: source.measure(context, 1, STORED),
                lambda again=again: source.further(context, STORED, result, again),
            ):
                controller.tools.select(1)
                with pytest.raises(DeclinedError):
                    steps()
        assert person.selected == [0, 0, 0, 0]


# Former names of calibration methods in old entries.


def test_what_was_written_before_is_the_name_of_a_method():
    assert {*former._FORMER.values()} <= {*method_names()}
    assert not {*former._FORMER} & {*method_names()}


def test_what_is_no_name_of_before_stays():
    assert method_name_now("plate-touch") == "plate-touch"
    assert with_method_name_now({"method": 3, "tip": []}) == {"method": 3, "tip": []}
    assert with_method_name_now({"tip": []}) == {"tip": []}
    assert finding_named_now("up_camera with tool 2") == "camera with tool 2"
    assert finding_named_now("") == ""


def test_a_solver_that_is_used_alone_names_its_method_too():
    result = solve_two_pose(Pose(287.5, 103.25, 0, 0), Pose(312.5, 96.75, 0, 180))
    assert result.method == "two-pose"
