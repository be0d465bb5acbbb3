"""The screen follows the robot while it moves, as far as the line can be asked meanwhile."""

from dataclasses import replace

import pytest
from robolink_cli.prompts.current_desk import sitting_at
from robolink_cli.session.stop_listener import watched_at_desk
from robolink_cli.wizard.flow import advance
from robolink_cli.wizard.happenings import CellIs, Reading, WasRead, WasRegarded
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.work import Desk
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink.model import MotionProfile, Path, Pose, WorkBox
from robolink.runner import Move, MoveSubject, Question, Runner, RunSettings
from robolink.testing import MemoryController
from tests.cli.wizard._people import ARRIVAL, HEADER, Sitting

pytestmark = pytest.mark.simulator_only


def test_what_follows_a_movement_reaches_the_screen():
    desk, controller = Desk(), MemoryController()
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
    """Move 25 mm in a second and more; return the readings that came meanwhile."""
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


@pytest.mark.soak
def test_a_plc_tells_where_it_is_while_it_moves():
    with serve_modbus_tcp(SoftMotionSimulator(seed=3), clock=ScaledClock(1.0)) as host:
        heights = [one.pose.z_mm for one in followed(host.url) if one.pose is not None]
    assert len(set(heights)) > 1
    assert heights == sorted(heights, reverse=True)


def test_an_epson_controller_tells_its_state_alone():
    with serve_tcp(EpsonSimulator(seed=7), clock=ScaledClock(1.0)) as host:
        readings = followed(host.url)
    assert readings
    assert all(one.pose is None for one in readings)
    assert "running" in {one.state for one in readings}


def test_what_is_not_known_is_said_and_the_picture_stays_where_the_movement_began():
    state = Sitting(WizardState(HEADER)).reads(ARRIVAL).state
    going = MoveSubject(Pose(300.0, 400.0, -60.0, 90.0, tool=0), Path.JOINT, 20.0, "Turning.")
    for one in (WasRegarded(going), WasRead(Reading(11.0, "running"))):
        state, _ = advance(state, one)
    rows = "\n".join(screen_of(state, 11.1).rows())
    assert state.pose == ARRIVAL
    assert "Picture of the start: this controller tells no position while it moves." in rows
    assert "reading 0.1 s" in rows
    there = Reading(11.2, "running", pose=replace(ARRIVAL, z_mm=-70.0))
    state, _ = advance(state, WasRead(there))
    assert "Picture of the start" not in "\n".join(screen_of(state, 11.3).rows())


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
