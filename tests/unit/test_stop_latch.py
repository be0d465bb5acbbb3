"""What a stop lets through, and to whom."""

import threading

import pytest

from robolink.checkpoints import Checkpoint, checkpoint, observed
from robolink.controllers.epson.session import command_class_of
from robolink.controllers.softmotion.commands import command_class_of as class_of_command
from robolink.errors import NotReadyError, NotReadyReason, OutcomeUnknownError, StoppedError
from robolink.protocols.epson_text import COMMANDS, Request
from robolink.protocols.mailbox import Command, Opcode
from robolink.stop_latch import CommandClass, StopLatch

LOOK, CALM, RESET, RESTORE, WRITE, ACT = CommandClass
HELD_BACK = (RESTORE, WRITE, ACT)


@pytest.fixture
def latch():
    return StopLatch("robot")


def admitted(latch):
    """Return what passes in this thread."""
    passed = set()
    for kind in CommandClass:
        try:
            latch.admit(kind, "request")
        except StoppedError:
            continue
        else:
            passed.add(kind)
    return passed


def test_open_it_lets_everything_pass(latch):
    assert admitted(latch) == set(CommandClass)
    latch.close()
    latch.release()
    assert admitted(latch) == set(CommandClass)


def test_closed_it_lets_pass_what_looks_and_what_calms(latch):
    latch.close()
    assert admitted(latch) == {LOOK, CALM}


def test_who_restores_may_restore_and_nothing_else(latch):
    latch.close()
    with latch.restoring():
        assert admitted(latch) == {LOOK, CALM, RESTORE}
        latch.require_open("restoring")
    assert admitted(latch) == {LOOK, CALM}


def test_a_permission_is_that_of_one_thread(latch):
    latch.close()
    elsewhere = []
    with latch.putting_back(1):
        assert admitted(latch) == {LOOK, CALM, RESTORE, WRITE}
        thread = threading.Thread(target=lambda: elsewhere.append(admitted(latch)))
        thread.start()
        thread.join()
    assert elsewhere == [{LOOK, CALM}]


def test_each_tool_is_put_back_once(latch):
    latch.close()
    with latch.putting_back(1):
        pass
    with pytest.raises(StoppedError, match="Tool 1, put back once more"), latch.putting_back(1):
        raise AssertionError("a second time")
    with latch.putting_back(2):
        pass
    latch.release()
    latch.close()
    with latch.putting_back(1):
        pass


def test_a_roll_back_in_which_the_stop_falls_is_the_one(latch):
    with latch.putting_back(1):
        latch.close()
        assert WRITE in admitted(latch)
    with pytest.raises(StoppedError), latch.putting_back(1):
        raise AssertionError("a second time")


def test_under_a_stop_nothing_begins_and_nothing_ends_well(latch):
    with pytest.raises(StoppedError, match="ended by a stop"), latch.watching("jog"):
        latch.close()
    with pytest.raises(StoppedError, match="ended by a stop"), latch.watching("jog"):
        raise AssertionError("it began")


def test_a_reset_that_a_person_asks_for_under_a_stop_is_let_through(latch):
    latch.close()
    with latch.calming("reset"):
        assert admitted(latch) == {LOOK, CALM, RESET}
    assert admitted(latch) == {LOOK, CALM}


@pytest.mark.parametrize("stopped_before", [False, True])
def test_a_reset_of_before_a_stop_is_not_sent_after_it_and_does_not_end_well(latch, stopped_before):
    if stopped_before:
        latch.close()
    with pytest.raises(StoppedError, match="reset: ended by a stop"), latch.calming("reset"):
        latch.close()
        assert admitted(latch) == {LOOK, CALM}


def test_what_the_controller_says_under_a_stop_is_the_stop_and_doubt_stays_doubt(latch):
    held = NotReadyError("held", reason=NotReadyReason.PAUSED)
    with pytest.raises(NotReadyError), latch.watching("jog"):
        raise held
    with pytest.raises(StoppedError) as caught, latch.watching("jog"):
        latch.close()
        raise held
    assert caught.value.__context__ is held
    latch.release()
    with pytest.raises(OutcomeUnknownError), latch.watching("jog"):
        latch.close()
        raise OutcomeUnknownError("lost")


def test_closing_a_link_waits_for_the_stop_that_uses_it(latch):
    begun, ending, closed = threading.Event(), threading.Event(), threading.Event()

    def stop():
        with latch.stopping():
            begun.set()
            ending.wait(10)

    def close():
        latch.await_stops(10)
        closed.set()

    threads = [threading.Thread(target=stop), threading.Thread(target=close)]
    threads[0].start()
    assert begun.wait(10)
    threads[1].start()
    assert not closed.wait(0.02)
    ending.set()
    assert closed.wait(10)
    for thread in threads:
        thread.join()


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("Print RealPos", LOOK),
        ("Where", LOOK),
        ("TLSet", LOOK),
        ("Base", LOOK),
        ("Base XY(1, 0, 0, 0)", ACT),
        ("Tool 0", RESTORE),
        ("Power Low", RESTORE),
        ("Speed 5, 5, 5", RESTORE),
        ("SpeedS 20.5", RESTORE),
        ("TLSet 1, XY(1.000, 2.000, 3.000, 0.000)", WRITE),
        ("TLClr 1", WRITE),
        ("Go XY(1.000, 2.000, 3.000, 0.000) /R /0", ACT),
        ("Move XY(1.000, 2.000, 3.000, 0.000) Till Sw(1) = On", ACT),
        ("Print 1; Go P1", ACT),
        ("Tool 1; Go P1", ACT),
        ("Tool 1 Go P1", ACT),
        ("tool 1", ACT),
        ("Motor On", ACT),
        ("", ACT),
    ],
)
def test_a_statement_is_what_its_text_says(statement, expected):
    assert command_class_of(Request("Execute", (statement,))) is expected


def test_every_request_that_is_not_known_to_look_or_calm_acts():
    looking = {c.name for c in COMMANDS if command_class_of(Request(c.name)) is LOOK}
    calming = {c.name for c in COMMANDS if command_class_of(Request(c.name)) is CALM}
    assert all(name.startswith("Get") or name in ("Login", "Logout") for name in looking)
    assert calming == {"Stop", "Abort", "Pause", "SetMotorsOff", "ResetAlm"}
    assert command_class_of(Request("Reset")) is RESET
    assert command_class_of(Request("Start", ("0",))) is ACT
    assert command_class_of(Request("SetIO", ("1", "1"))) is ACT
    assert command_class_of(Request("Unheard")) is ACT


def test_what_moves_a_plc_is_held_back_and_what_ends_it_is_not():
    acting = {
        code for code in Opcode if class_of_command(Command(0, code, operands=(1, 0, 0, 0))) is ACT
    }
    assert acting == {
        *(Opcode.ENABLE, Opcode.CONTINUE, Opcode.JOG, Opcode.MOVE_DIRECT, Opcode.MOVE_LINEAR),
        *(Opcode.SET_KINEMATICS, Opcode.WRITE_OUTPUT, Opcode.MOVE_UNTIL_INPUT),
    }
    assert class_of_command(Command(0, Opcode.JOG)) is CALM  # both masks 0: its end
    assert class_of_command(Command(0, Opcode.STOP)) is CALM
    assert class_of_command(Command(0, Opcode.STOP, operands=(1, 0, 0, 0))) is RESET  # its release
    assert class_of_command(Command(0, Opcode.RESET)) is RESET


def test_checkpoints_are_seen_while_somebody_looks_and_cost_nothing_else():
    seen = []
    checkpoint(Checkpoint.STEP, "before")
    with observed(lambda point, what: seen.append((point, what))):
        checkpoint(Checkpoint.STEP, "meanwhile")
        with observed(lambda _point, _what: None):
            checkpoint(Checkpoint.STEP, "somebody else looks")
        checkpoint(Checkpoint.LOCK)
    checkpoint(Checkpoint.STEP, "after")
    assert seen == [(Checkpoint.STEP, "meanwhile"), (Checkpoint.LOCK, "")]
