"""The end of a jog on a PLC that does not accept the end, or has ended the jog before."""

from dataclasses import replace

import pytest

from robolink.controllers import Jog
from robolink.errors import (
    ControllerFaultError,
    LeaseLostError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportClosedError,
)
from robolink.model import MotionProfile, Path, Pose, WorkBox
from robolink.protocols.mailbox import (
    Bits,
    Command,
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
)

ANYWHERE = WorkBox()
ALONG_X = Jog(forward=frozenset({0}), speed_mm_s=3.0)


def jog(controller, duration_s=1.0):
    return controller.groups[0].jog(ALONG_X, duration_s=duration_s, box=ANYWHERE)


def ends_a_jog(command: Command) -> bool:
    return command.opcode == Opcode.JOG and not any(command.operands[:2])


def moves_nothing(plc) -> bool:
    return plc.now.group_state != GroupState.MOVING and not plc.now.bits & Bits.JOGGING


def test_a_jog_whose_end_is_refused_is_halted(cell, plc, controller):
    plc.refuses = lambda command: ErrorClass.NOT_PERMITTED if ends_a_jog(command) else 0
    with pytest.raises(RejectedError, match="114") as refusal:
        jog(controller)
    assert refusal.value.code == ErrorClass.NOT_PERMITTED
    assert plc.opcodes() == [Opcode.JOG, Opcode.JOG, Opcode.HALT]
    assert moves_nothing(plc)
    assert cell.open_requests() == []


def test_a_jog_whose_end_is_not_acknowledged_is_halted(cell, plc, controller):
    plc.overhears = ends_a_jog
    with pytest.raises(ControllerFaultError, match=r"did not acknowledge.*was stopped"):
        jog(controller)
    assert plc.opcodes() == [Opcode.JOG, Opcode.HALT]
    assert moves_nothing(plc)
    # The session goes on, and the end of the jog was read.
    assert not controller.status().running
    assert cell.open_requests() == []


def test_a_jog_whose_end_is_taken_and_not_seen_to_end_is_halted(cell, plc, controller):
    """Looks are refused for a while just then; the halt is seen."""
    acknowledge = plc.acknowledge

    def refused():
        for _ in range(3):
            cell.link.refuse("read_head")

    def begun_and_refused(command, state, error):
        acknowledge(command, state, error)
        if ends_a_jog(command):
            plc.now = replace(plc.now, state=CommandState.ACTIVE)
            cell.link.before("read_response", refused)

    plc.acknowledge = begun_and_refused
    with pytest.raises(ControllerFaultError, match=r"did not acknowledge.*was stopped") as failure:
        jog(controller)
    assert isinstance(failure.value.__cause__, RemoteProtocolError)
    assert plc.opcodes() == [Opcode.JOG, Opcode.JOG, Opcode.HALT]
    assert moves_nothing(plc)
    assert cell.open_requests() == []


def test_a_jog_whose_end_and_halt_are_not_acknowledged_is_stopped(plc, controller):
    plc.overhears = lambda command: ends_a_jog(command) or command.opcode == Opcode.HALT
    with pytest.raises(ControllerFaultError, match=r"did not acknowledge.*was stopped"):
        jog(controller)
    assert plc.opcodes() == [Opcode.JOG, Opcode.STOP]
    assert moves_nothing(plc)
    assert controller.status().paused


def test_a_jog_that_nothing_ends_is_unknown_and_no_beat_follows(cell, plc, controller):
    plc.overhears = lambda command: command.only_ends
    ending = []
    cell.link.before("write_command", lambda: ending.append(len(cell.link.beats)), nth=2)
    with pytest.raises(OutcomeUnknownError) as unknown:
        jog(controller)
    assert "emergency stop" in unknown.value.remedy
    assert ending == [len(cell.link.beats)]
    assert len(cell.open_requests()) == 1
    with pytest.raises(TransportClosedError):
        controller.status()
    plc.advance()
    assert moves_nothing(plc)  # its own watchdog has ended it


def ended_by_plc(plc, state, error, *, seen="head"):
    """Let the PLC end the jog by itself, shown in the head or only among the last ends."""

    def end():
        (command,) = plc.executed
        plc.now = replace(plc.now, bits=plc.now.bits & ~Bits.JOGGING)
        end = Finished(command.sequence, state, error)
        if seen == "head":
            plc.now = replace(plc.now, state=state, error_class=error)
        else:
            plc.now = replace(plc.now, finished=(end, *plc.now.finished[:3]), ack_head=9999)

    return end


@pytest.mark.parametrize("seen", ["head", "ends"])
@pytest.mark.parametrize(
    ("state", "error", "expected"),
    [
        (CommandState.ABORTED, ErrorClass.NOT_PERMITTED, RejectedError),
        (CommandState.ABORTED, ErrorClass.HEARTBEAT_LOST, ControllerFaultError),
        (CommandState.ABORTED, ErrorClass.NONE, ControllerFaultError),
        (CommandState.ABORTED, ErrorClass.NOT_OWNER, RejectedError),
        (CommandState.ERROR, ErrorClass.UNREACHABLE, RejectedError),
    ],
)
def test_a_jog_that_the_plc_ended_is_no_success(
    cell, plc, controller, state, error, expected, seen
):
    cell.link.before("read_head", ended_by_plc(plc, state, error, seen=seen), nth=20)
    with pytest.raises(expected) as failure:
        jog(controller, duration_s=30.0)
    assert failure.value.code == error
    assert plc.opcodes() == [Opcode.JOG]  # nothing is left to end
    assert cell.open_requests() == []


def test_a_beat_for_the_ownership_goes_out_once_a_second_while_nothing_is_unfinished(
    cell, plc, controller
):
    for _ in range(100):
        controller.status()
        plc.clock.sleep(0.1)
    assert 9 <= len(cell.link.beats) <= 12


def test_looking_does_not_keep_a_movement_going(cell, plc, controller):
    group = controller.groups[0]
    target = Pose(410.0, 90.0, 250.0, 45.0, tool=0)
    profile = MotionProfile(Path.STRAIGHT, speed_mm_s=20.0)
    motions = [group.move_to(target, profile, box=ANYWHERE) for _ in range(4)]
    before = len(cell.link.beats)
    for _ in range(10):
        controller.status()
        group.pose()
        controller.tools.read(3)
        plc.clock.sleep(0.1)
    assert len(cell.link.beats) == before
    with pytest.raises(ControllerFaultError, match="heartbeat was missing"):
        motions[3].wait(timeout_s=5)


OTHERS = 0x0BAD_CAFE


def seized(plc, *, moves_on=True, tells=True):
    """Let another client take the mailbox; later movements are that client's."""

    def seize():
        (command,) = plc.executed
        plc.owner, plc.epoch = OTHERS, plc.epoch + 1
        end = Finished(command.sequence, CommandState.ABORTED, ErrorClass.NOT_OWNER)
        ends = (end, *plc.now.finished[:3]) if tells else plc.now.finished
        bits = plc.now.bits if moves_on else plc.now.bits & ~Bits.JOGGING
        plc.now = replace(plc.now, finished=ends, bits=bits, ack_head=9999, ack_owner=OTHERS)

    return seize


def test_a_jog_that_another_program_takes_over_is_said_to_be_and_what_he_moves_is_his(
    cell, plc, controller
):
    cell.link.before("read_head", seized(plc), nth=20)
    with pytest.raises(RejectedError, match="another program has taken it over") as failure:
        jog(controller, duration_s=30.0)
    assert failure.value.code == ErrorClass.NOT_OWNER
    assert plc.opcodes() == [Opcode.JOG]
    assert cell.open_requests() == []
    with pytest.raises(LeaseLostError, match="another client has taken over the mailbox"):
        jog(controller)
    assert plc.opcodes() == [Opcode.JOG]


def test_the_end_of_a_jog_goes_out_although_the_mailbox_is_lost(cell, plc, controller):
    cell.link.before("read_head", seized(plc, tells=False), nth=20)
    jog(controller, duration_s=3.0)
    assert plc.opcodes() == [Opcode.JOG, Opcode.JOG]
    end = plc.executed[-1]
    assert end.only_ends
    assert end.owner != plc.owner
    assert plc.now.ack_head == end.sequence
    assert (plc.now.state, plc.now.error_class) == (CommandState.DONE, ErrorClass.NONE)
    assert moves_nothing(plc)


def test_the_end_of_a_jog_goes_out_once_it_is_known_that_the_mailbox_is_lost(cell, plc, controller):
    lose = controller._mailbox.commands.ownership.lose
    cell.link.before("read_head", lambda: (seized(plc, tells=False)(), lose()), nth=20)
    jog(controller, duration_s=3.0)
    assert plc.executed[-1].only_ends
    assert moves_nothing(plc)


def test_an_older_program_that_refuses_the_end_is_halted(cell, plc, controller):
    plc.refuses = lambda command: ErrorClass.NOT_OWNER if ends_a_jog(command) else 0
    with pytest.raises(RejectedError, match="106"):
        jog(controller)
    assert plc.opcodes() == [Opcode.JOG, Opcode.JOG, Opcode.HALT]
    with pytest.raises(LeaseLostError):
        jog(controller)
