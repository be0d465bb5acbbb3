"""The display of the work: the screen that follows the robot, and an interface that fails."""

import os
import threading
from dataclasses import replace

import click
import pytest
from robolink_cli.prompts.current_desk import current_desk, sitting_at
from robolink_cli.session.stop_listener import watched_at_desk
from robolink_cli.wizard.flow import advance
from robolink_cli.wizard.happenings import CellIs, Reading, WasRead, WasRegarded
from robolink_cli.wizard.host import _shown, guided
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.work import Desk, Work
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink.calibration_run import ChangeReport, ToolReport
from robolink.controllers import SimpleController
from robolink.errors import ConfigError, DeclinedError
from robolink.model import MotionProfile, Path, Pose, ToolReceipt, WorkBox
from robolink.runner import Move, MoveSubject, Question, Runner, RunSettings
from tests.cli.wizard._people import ARRIVAL, HEADER, Sitting, write_subject

# The end of the work when its interface can no longer show it.


class Typist:
    """Types a line each time the dialogue offers something at its end; keeps the messages.

    Args:
        lines: The lines to type, in order.
    """

    def __init__(self, lines):
        self.lines, self.seen = list(lines), ""
        self._far, self._near = os.pipe()
        self.input = os.fdopen(self._far, encoding="utf-8")

    def write(self, text):
        self.seen += text
        if "finish = leave." in text and self.lines:
            threading.Timer(0.1, os.write, (self._near, self.lines.pop(0).encode() + b"\n")).start()
        return len(text)

    def flush(self):
        """Do nothing: no output is buffered."""


def carried_out():
    """Return the report of a change of one tool."""
    (proposal,), ((verdict,),) = (one := write_subject(1)).proposals, one.verdicts
    receipt = ToolReceipt(1, proposal.before, proposal.offset, proposal.offset)
    return ChangeReport("7f3a5c1200", (ToolReport(proposal, receipt, None, (verdict,)),))


@pytest.mark.parametrize("taken", [True, False])
def test_lines_offer_the_page_and_the_next_tool_once_a_job_is_carried_out(monkeypatch, taken):
    typist = Typist(["", "report", "report", "next", "finish"])
    monkeypatch.setenv("ROBOLINK_PLAIN", "1")
    monkeypatch.setattr("sys.stdin", typist.input)
    monkeypatch.setattr("sys.stderr", typist)
    done, pages = [], []

    def job(name):
        done.append(name)
        desk = current_desk()
        assert desk is not None
        desk.regard(None)
        desk.regard(carried_out())
        return name

    def page(change):
        pages.append(change)
        if not taken:
            raise ConfigError("There is a file of that name.", remedy="Move it.")
        return ("Report: /cell/change.html",)

    with click.Context(click.Command("x")):
        last = guided(HEADER, lambda: job("first"), report=page, following=lambda: job("second"))
    assert (done, last) == (["first", "second"], "second")
    assert typist.lines == []
    # The page is written once; if that failed, it is offered again.
    assert pages == ["7f3a5c1200"] * (1 if taken else 2)
    said = "Report: /cell/change.html" if taken else "There is a file of that name."
    assert typist.seen.count(said) == len(pages)
    assert typist.seen.count("Tool 1 is measured and written, not tested.") == 2, "each job once"
    assert typist.seen.count("report = show the report.") == (3 if taken else 5)


class Breaking:
    """An interface that fails after a question."""

    def __init__(self, error):
        self.error = error

    def run(self, desk, state, work):
        while not desk.happened():
            pass
        raise self.error


@pytest.mark.parametrize("error", [EOFError(), OSError(5, "gone"), ZeroDivisionError()], ids=repr)
def test_the_work_is_ended_in_order_when_the_face_breaks(error):
    desk, put_back = Desk(), []

    def measure():
        try:
            desk.ask("Jog the tip onto the pin.", Question.PLACE)
            while desk.poll(0.2) is None:
                pass
        finally:
            put_back.append("tool 1")

    with click.Context(click.Command("x")):
        work = Work(measure)
        work.start()
        try:
            _shown(Breaking(error), desk, WizardState(HEADER), work)
        except ZeroDivisionError:
            assert isinstance(error, ZeroDivisionError)  # a defect is not hidden
        else:
            assert not isinstance(error, ZeroDivisionError)
    assert work.ended
    assert put_back == ["tool 1"]
    assert isinstance(work.error, DeclinedError)


# The screen follows the robot while it moves, as far as the line can be polled meanwhile.


@pytest.mark.simulator_only
def test_what_follows_a_movement_reaches_the_screen():
    desk, controller = Desk(), SimpleController()
    target = Pose(300, 0, 90, 30, tool=0)

    def course():
        yield Move(target, Path.STRAIGHT, "Lowering.", then="You touch.")
        yield Move(target, Path.STRAIGHT, "Lifting.")

    settings = RunSettings(WorkBox(z_max_mm=200), speed_mm_s=12.0)
    Runner(controller, controller.groups[0], desk, settings).run(course())
    told = [one.subject for one in desk.happened() if isinstance(one, WasRegarded)]
    moves = [one for one in told if isinstance(one, MoveSubject)]
    assert [(one.purpose, one.then, one.speed_mm_s) for one in moves] == [
        ("Lowering.", "You touch.", 12.0),
        ("Lifting.", "", 12.0),
    ]


def followed(url):
    """Move 25 mm in a second or more; return the readings during that time."""
    desk = Desk()
    with robolink.connect(url) as controller, sitting_at(desk), watched_at_desk(controller):
        group = controller.groups[0]
        if controller.capabilities.motors:
            controller.motors(True)
        here = group.pose()
        box = WorkBox.around(here, xy_mm=60.0, below_mm=60.0, above_mm=60.0)
        target = replace(here, z_mm=here.z_mm - 25.0)
        known = [one.subject for one in desk.happened() if isinstance(one, WasRegarded)]
        assert CellIs(simulated=True) in known, "its serial number, or its mailbox, says so"
        desk.regard(MoveSubject(target, Path.STRAIGHT, 20.0, "Lowering."))
        profile = MotionProfile(Path.STRAIGHT, 5, 20.0)
        group.move_to(target, profile, box=box).wait(timeout_s=30.0)
        desk.ask("?", Question.PLACE)
    return [one.reading for one in desk.happened() if isinstance(one, WasRead)]


@pytest.mark.simulator_only
@pytest.mark.soak
def test_a_plc_tells_where_it_is_while_it_moves():
    with serve_modbus_tcp(SoftMotionSimulator(seed=3), clock=ScaledClock(1.0)) as host:
        heights = [one.pose.z_mm for one in followed(host.url) if one.pose is not None]
    assert len(set(heights)) > 1
    assert heights == sorted(heights, reverse=True)


@pytest.mark.simulator_only
def test_an_epson_controller_tells_its_state_alone():
    with serve_tcp(EpsonSimulator(seed=7), clock=ScaledClock(1.0)) as host:
        readings = followed(host.url)
    assert readings
    assert all(one.pose is None for one in readings)
    assert "running" in {one.state for one in readings}


@pytest.mark.simulator_only
def test_what_is_not_known_is_said_and_the_picture_stays_where_the_movement_began():
    state = Sitting(WizardState(HEADER)).reads(ARRIVAL).state
    going = MoveSubject(Pose(300.0, 400.0, -60.0, 90.0, tool=0), Path.JOINT, 20.0, "Turning.")
    for one in (WasRegarded(going), WasRead(Reading(11.0, "running"))):
        state, _ = advance(state, one)
    rows = "\n".join(screen_of(state, 11.1).rows())
    assert state.pose == ARRIVAL
    assert "Picture of the start: this controller reports no position while it moves." in rows
    assert "reading 0.1 s" in rows
    there = Reading(11.2, "running", pose=replace(ARRIVAL, z_mm=-70.0))
    state, _ = advance(state, WasRead(there))
    assert "Picture of the start" not in "\n".join(screen_of(state, 11.3).rows())


@pytest.mark.simulator_only
def test_a_look_that_fails_ends_the_looking_and_nothing_else():
    from robolink.errors import TransportTimeoutError

    desk, looks = Desk(), []

    def look():
        looks.append(1)
        raise TransportTimeoutError("late", controller="x")

    with desk.following(look):
        desk.regard(MoveSubject(ARRIVAL, Path.STRAIGHT, 20.0, "Lowering."))
        for _ in range(100):
            if looks:
                break
            desk.poll(0.05)
    assert len(looks) == 1
