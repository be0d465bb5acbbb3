"""How few exchanges a step takes, and that none is spared on which something rests.

What was read in a step is not read again, where nothing can have changed what it says. Where
answers take longer than the PLC, one whole look replaces a look at the head and the look after it.
"""

import threading
from dataclasses import replace
from itertools import pairwise

import pytest

from robolink.controllers import Jog
from robolink.controllers.softmotion.heartbeat import FIRST_LOOK_S, POLL_S, watch_period_s
from robolink.controllers.softmotion.snapshots import STEP_S
from robolink.errors import (
    LimitError,
    NotReadyError,
    OutcomeUnknownError,
    RemoteProtocolError,
    StoppedError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.model import InputEdge, MotionOutcome, MotionProfile, Path, Pose, WorkBox
from robolink.protocols.mailbox import (
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
    decode_response,
    encode_response,
)
from robolink.timing import NS_PER_S
from tests.unit.softmotion_driver import _plc
from tests.unit.softmotion_driver._plc import MS, STRANGER

ANYWHERE = WorkBox()
TARGET = Pose(410.0, 90.0, 250.0, 45.0, tool=0)
STRAIGHT = MotionProfile(Path.STRAIGHT, speed_mm_s=20.0)
SLOW_S = 0.02
"""In this time a PLC has run several cycles."""

READS = ("read_head", "read_response", "read_slot")


@pytest.fixture
def asked(cell):
    """The exchanges from now on, by name, in their order."""
    names: list[str] = []
    for method in (*READS, "write_command", "beat"):
        exchange = getattr(cell.link, method)

        def noting(*args, exchange=exchange, method=method):
            names.append(method)
            return exchange(*args)

        setattr(cell.link, method, noting)
    return names


def move(group, profile=STRAIGHT):
    return group.move_to(TARGET, profile, box=ANYWHERE)


def seek(group, edge=3):
    """Seek the falling edge of an input that is on."""
    edge = InputEdge(edge, falling=True)
    return group.move_until_input(TARGET, edge, speed_mm_s=2.0, box=ANYWHERE)


# Where the tip is after a movement.


def test_the_snapshot_that_showed_the_rest_shows_where_the_tip_is(group, asked):
    move(group).wait(timeout_s=5)
    asked.clear()
    assert group.pose().z_mm == pytest.approx(TARGET.z_mm)
    assert asked == []


def happenings(plc, controller):
    return {
        "time passes": lambda: plc.clock.sleep(STEP_S + 0.001),
        "a command": lambda: controller.io.read_input(3),
        "another reading": controller.status,
    }


@pytest.mark.parametrize("happens", ["time passes", "a command", "another reading"])
def test_after_anything_else_the_place_is_read_anew(plc, controller, group, happens):
    move(group).wait(timeout_s=5)
    happenings(plc, controller)[happens]()
    plc.now = replace(plc.now, tcp=(1.0, *plc.now.tcp[1:]))
    assert group.pose().x_mm == 1.0


def test_the_place_of_a_group_that_still_moves_is_read_anew(cell, plc, controller, group, asked):
    """A program that calls a movement done while it brakes, and brakes for longer than a second."""
    motion = move(group)
    plc.clock.sleep(0.49)
    plc_state, state = plc.response, GroupState.MOVING
    plc.response = lambda: _with(plc_state(), state)
    assert motion.wait(timeout_s=5) is MotionOutcome.ARRIVED
    asked.clear()
    group.pose()
    assert "read_response" in asked


def _with(words, state):
    """Return a response block whose group is in another state."""
    return encode_response(replace(decode_response(words), group_state=state))


def test_the_place_before_a_movement_is_not_that_of_the_movement_before(plc, group):
    move(group).wait(timeout_s=5)
    under_way = group.move_to(replace(TARGET, z_mm=240.0), STRAIGHT, box=ANYWHERE)
    plc.now = replace(plc.now, tcp=(2.0, *plc.now.tcp[1:]))
    assert group.pose().x_mm == 2.0
    under_way.wait(timeout_s=5)


# The place of an edge.


def test_an_edge_takes_no_reading_of_its_own(cell, plc, group, asked):
    plc.edge = (405.0, 95.0, 271.25, 30.0, 0.0, 0.0)
    motion = seek(group)
    plc.clock.sleep(0.6)
    asked.clear()
    assert motion.wait(timeout_s=5).z_mm == pytest.approx(271.25)
    assert asked.count("read_response") == 1


@pytest.mark.parametrize("whose", ["ours", "another's"])
def test_an_edge_whose_answer_another_command_replaced_is_no_edge(cell, plc, group, whose):
    """What the block then shows is the answer to that command."""
    plc.edge = (405.0, 95.0, 271.25, 30.0, 0.0, 0.0)
    motion = seek(group)
    end = Finished(plc.now.ack_head, CommandState.DONE, ErrorClass.NONE)
    plc._queue.clear()
    owner = plc.now.ack_owner if whose == "ours" else STRANGER
    plc.now = replace(
        plc.now,
        ack_head=plc.now.ack_head + 1,
        ack_owner=owner,
        opcode_echo=Opcode.READ_INPUT,
        state=CommandState.DONE,
        finished=(end, *plc.now.finished[:3]),
    )
    with pytest.raises(RemoteProtocolError, match="latched"):
        motion.wait(timeout_s=5)


# What needs no snapshot of its own.


def test_an_input_is_read_after_the_snapshot_of_the_step(cell, controller, group, asked):
    move(group).wait(timeout_s=5)
    asked.clear()
    controller.io.read_input(3)
    assert asked[0] == "write_command"


@pytest.mark.parametrize("moment", ["later", "after a restart"])
def test_an_input_is_not_read_from_a_plc_of_before(plc, controller, group, moment):
    move(group).wait(timeout_s=5)
    if moment == "later":
        plc.clock.sleep(STEP_S + 0.001)
        plc.restart()
        with pytest.raises(TransportBrokenError, match="restarted"):
            controller.io.read_input(3)
        assert plc.opcodes()[-1] is Opcode.MOVE_LINEAR
        return
    plc.restart()  # within the step: the block names the start that was met, and it is answered
    with pytest.raises((TransportBrokenError, TransportTimeoutError, RemoteProtocolError)):
        controller.io.read_input(3)


def test_a_search_reads_its_input_and_then_looks_once_more(cell, plc, group, asked):
    """The input is read before each search, and a snapshot stands just before its block."""
    plc.edge = (405.0, 95.0, 271.25, 30.0, 0.0, 0.0)
    seek(group).wait(timeout_s=5)
    plc.executed.clear()
    asked.clear()
    motion = seek(group)
    assert plc.opcodes() == [Opcode.READ_INPUT, Opcode.MOVE_UNTIL_INPUT]
    blocks = [n for n, name in enumerate(asked) if name == "write_command"]
    assert asked[blocks[1] - 1] == "read_response"
    motion.wait(timeout_s=5)


def test_a_search_whose_input_has_switched_meanwhile_moves_nothing(plc, group):
    plc.edge = (405.0, 95.0, 271.25, 30.0, 0.0, 0.0)
    seek(group).wait(timeout_s=5)
    plc.inputs[3] = 0
    plc.executed.clear()
    with pytest.raises(NotReadyError):
        seek(group)
    assert plc.opcodes() == [Opcode.READ_INPUT]


# Slow answers.


@pytest.fixture
def slow(cell, plc, controller):
    """A PLC that answers late, as was found out with a few looks."""
    cell.link.answer_s = SLOW_S
    snapshots = controller._mailbox.snapshots
    snapshots._head_s = float("inf")  # what was learnt when it answered at once
    snapshots._head()
    snapshots.take()
    return snapshots


@pytest.mark.usefixtures("slow")
def test_where_answers_are_late_a_whole_look_replaces_two(controller, group, asked):
    move(group).wait(timeout_s=5)
    controller.io.read_input(3)
    assert "read_head" not in asked


def test_where_answers_come_at_once_the_head_is_looked_at(controller, group, asked):
    move(group).wait(timeout_s=5)
    controller.io.read_input(3)
    assert "read_head" in asked


@pytest.mark.usefixtures("slow")
@pytest.mark.parametrize("quick", [False, True])
def test_a_link_that_is_quick_again_is_looked_at_by_its_head_again(cell, controller, asked, quick):
    if quick:
        cell.link.answer_s = 0.001
    for _ in range(3):
        controller.io.read_input(3)
    assert ("read_head" in asked) is quick


@pytest.mark.usefixtures("slow")
def test_where_the_whole_block_takes_longer_the_head_is_looked_at(cell, controller, asked):
    """On a bus the block comes in many frames, the head in one."""
    whole = cell.link.read_response

    def longer():
        cell.link.clock.sleep(2 * SLOW_S)
        return whole()

    cell.link.read_response = longer
    for _ in range(3):
        controller.io.read_input(3)
    assert "read_head" in asked


@pytest.mark.usefixtures("slow")
def test_a_dead_motion_task_is_noticed_where_answers_are_late(plc, group, monkeypatch):
    monkeypatch.setattr(_plc, "MOVE_NS", 9_000 * MS)
    motion = move(group)
    plc.frozen = True
    began_ns = plc.clock.now_ns()
    with pytest.raises(OutcomeUnknownError, match="heartbeat"):
        motion.wait(timeout_s=20)
    assert plc.clock.now_ns() - began_ns < 2 * NS_PER_S


@pytest.mark.usefixtures("slow")
def test_a_jog_ends_in_time_and_in_its_box_where_answers_are_late(plc, group):
    began_ns = plc.clock.now_ns()
    group.jog(Jog(forward=frozenset({0}), speed_mm_s=5.0), duration_s=0.4, box=ANYWHERE)
    assert plc.clock.now_ns() - began_ns < (0.4 + 12 * SLOW_S) * NS_PER_S
    with pytest.raises(LimitError):
        group.jog(
            Jog(forward=frozenset({0}), speed_mm_s=5.0),
            duration_s=5.0,
            box=WorkBox(x_max_mm=plc.now.tcp[0] - 1.0),
        )


@pytest.mark.usefixtures("slow")
def test_a_stop_is_confirmed_by_rest_where_answers_are_late(plc, controller, group, monkeypatch):
    monkeypatch.setattr(_plc, "MOVE_NS", 9_000 * MS)
    motion = move(group)
    stopper = threading.Thread(target=controller.stop)
    stopper.start()
    with pytest.raises(StoppedError):
        motion.wait(timeout_s=20)
    stopper.join(5)
    assert plc.now.group_state == GroupState.STOPPING
    assert plc.opcodes()[-1] is Opcode.STOP


# How often a search is looked at.


def test_a_search_is_looked_at_often_enough_and_not_more():
    now_s, looks = 0.0, []
    while now_s < 2.0:
        now_s += watch_period_s(now_s)
        looks.append(now_s)
    assert looks[0] == pytest.approx(FIRST_LOOK_S)
    pairs = list(pairwise(looks))
    assert all(b - a <= max(0.005, a / 10) + 1e-9 for a, b in pairs)
    assert max(b - a for a, b in pairs) <= POLL_S + 1e-9
    assert len([at for at in looks if at < 0.1]) <= 9


@pytest.mark.parametrize("lasts_ms", [52, 76, 104, 165, 700])
def test_the_end_of_a_search_is_noticed_soon(plc, group, monkeypatch, lasts_ms):
    monkeypatch.setattr(_plc, "MOVE_NS", lasts_ms * MS)
    plc.edge = (405.0, 95.0, 271.25, 30.0, 0.0, 0.0)
    motion = seek(group)
    began_ns = plc.clock.now_ns()
    motion.wait(timeout_s=5)
    late_s = (plc.clock.now_ns() - began_ns - lasts_ms * MS) / NS_PER_S
    assert late_s <= max(0.005, lasts_ms / 1000 / 10, 0.0) + 0.006


def test_a_movement_that_leads_nowhere_is_not_waited_for(plc, group, monkeypatch):
    """A direct movement to where the tip stands is over within a cycle."""
    monkeypatch.setattr(_plc, "MOVE_NS", 4 * MS)
    here = group.pose()
    began_ns = plc.clock.now_ns()
    group.move_to(here, MotionProfile(Path.JOINT), box=ANYWHERE).wait(timeout_s=5)
    assert (plc.clock.now_ns() - began_ns) / NS_PER_S < 0.025
