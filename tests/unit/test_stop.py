"""A stop: requests that its latch lets through, its note, and the stopped state on EPSON."""

import inspect
import json
import sys
import threading
from contextlib import suppress
from itertools import count
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.cell.clock import ManualClock

from robolink.checkpoints import Checkpoint, checkpoint, observed
from robolink.controllers.epson.line import EpsonConversation, text_line
from robolink.controllers.epson.rest import REST_S, bring_to_rest
from robolink.controllers.epson.session import command_class_of
from robolink.controllers.softmotion.answers import command_class_of as class_of_command
from robolink.errors import (
    BusyError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    StoppedError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
)
from robolink.files.durable import file_name, state_folder
from robolink.journal._lease_view import LeaseHolder, LeaseView
from robolink.model import Elbow, Hand, Pose, Posture, Wrist
from robolink.protocols import spel
from robolink.protocols.epson_text import COMMANDS, Reply, Request
from robolink.protocols.mailbox import Command, Opcode
from robolink.stop_latch import CommandClass, StopLatch
from robolink.stopping import clear_note, find_note, leave_note
from robolink.timing import NS_PER_S
from tests._patience import PATIENCE_S
from tests._rows import each_row

# The requests that a stop lets through, and from whom.

LOOK, CALM, RESET, RESTORE, WRITE, ACT = CommandClass
HELD_BACK = (RESTORE, WRITE, ACT)


@pytest.fixture
def latch():
    return StopLatch("robot")


def admitted(latch):
    """Return the requests that pass in this thread."""
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


@each_row(
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
        ("Print Measure(1)", ACT),
        ("Print Tool, Measure", ACT),
        ("Print RobotModel", ACT),
        ("Print Toolbox(1)", ACT),
        ("Print XY(1, 2, 3, 4) + Measure(2)", ACT),
        ('Print "Tool", Measure("Tool")', ACT),
        ('Print #1, "Tool"', ACT),
        ("Print Sw(1) : Go P1", ACT),
        ("Print " + "P11" * 2000 + "#", ACT),
        ('Print "Measure(1)"', LOOK),
        ("Print PAgl(LJM(XY(300.000, 100.000, -60.000, 0.000) /R /0, Here, 2), 2)", LOOK),
        ("Print PAgl(XY(300.000, 100.000, -60.000, 0.000) /0, 2)", LOOK),
        ('Print "", Sw(3), TLSet(2)', LOOK),
        ("Tool 1; Go P1", ACT),
        ("Tool 1 Go P1", ACT),
        ("tool 1", ACT),
        ("Motor On", ACT),
        ("", ACT),
    ],
)
def test_a_statement_is_what_its_text_says(statement, expected):
    assert command_class_of(Request("Execute", (statement,))) is expected


POSES = st.builds(
    Pose,
    *[st.floats(-1e4, 1e4, allow_nan=False)] * 4,
    hand=st.sampled_from([None, *Hand]),
    posture=st.none()
    | st.builds(
        Posture,
        st.sampled_from(Elbow),
        st.sampled_from(Wrist),
        **dict.fromkeys(("j1_flag", "j4_flag", "j6_flag"), st.integers(-1, 1)),
        j1_angle_deg=st.none() | st.floats(-180, 180),
    ),
)
TAKEN = {
    "target": POSES,
    "six_axes": st.booleans(),
    "number": st.integers(0, 999),
    "tool": st.integers(1, 15),
    "bit": st.integers(0, 0xFFFF),
    "joint": st.integers(1, 6),
    "index": st.integers(1, 3),
}
BUILDERS = [name for name in spel.__all__ if name.startswith("print_") and name != "print_several"]
PRINTED = st.sampled_from(BUILDERS).flatmap(
    lambda name: st.builds(
        getattr(spel, name),
        **{taken: TAKEN[taken] for taken in inspect.signature(getattr(spel, name)).parameters},
    )
)


def executed(statement):
    """Return what the statement of an Execute does."""
    return command_class_of(Request("Execute", (statement,)))


@pytest.mark.parametrize("name", BUILDERS)
@given(data=st.data())
@settings(max_examples=10)
def test_each_print_of_robolink_looks(name, data):
    taken = inspect.signature(getattr(spel, name)).parameters
    statement = getattr(spel, name)(**{each: data.draw(TAKEN[each]) for each in taken})
    assert executed(statement) is LOOK


@given(st.lists(PRINTED, min_size=1, max_size=4))
@settings(max_examples=50)
def test_a_list_of_them_looks(queries):
    assert executed(spel.print_several(*queries)) is LOOK


@given(
    PRINTED,
    st.from_regex(r"(My|[a-z_])[A-Za-z0-9_]{0,12}[$]?(\([0-9, ]{0,9}\))?", fullmatch=True),
    st.sampled_from(("Print {0}", "Print {2}, {0}", "{1}, {0}", "{1} + {0}", "Print ({2}) {0}")),
)
def test_a_print_that_calls_a_function_of_the_project_acts(printed, own, form):
    statement = form.format(own, printed, printed.removeprefix("Print "))
    assert executed(statement) is ACT


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


# The note that a stop leaves: in doubt it stays, and it belongs to its own controller.

URL = "epson+tcp://192.168.0.1:5000"
HERE = {"192.168.0.1:5000"}


def path_of(key):
    return state_folder("stops") / file_name(key)


@pytest.mark.usefixtures("robolink_state")
def test_a_note_that_cannot_be_read_is_a_note_all_the_same():
    path_of(next(iter(HERE))).mkdir(parents=True)
    found = find_note(HERE)
    assert found is not None
    assert not found.confirmed
    assert "cannot be read" in found.sentence


@pytest.mark.usefixtures("robolink_state")
@pytest.mark.parametrize("confirmed", ["no", 1, None, False])
def test_rest_is_believed_only_where_the_note_says_so(confirmed):
    leave_note(HERE, URL, "mei", confirmed=True)
    path = path_of(next(iter(HERE)))
    kept = json.loads(path.read_bytes())
    path.write_text(json.dumps({**kept, "confirmed": confirmed}))
    found = find_note(HERE)
    assert found is not None
    assert not found.confirmed
    assert "it was not confirmed that the robot stopped" in found.sentence


@pytest.mark.usefixtures("robolink_state")
def test_a_note_of_another_controller_hides_none_of_this_one_and_stays():
    """Both were met at one address, one after the other."""
    leave_note(HERE, URL, "mei", confirmed=True, controller="SN-1")
    leave_note({"cable"}, URL, "jan", confirmed=True, controller="SN-2")
    both = {*HERE, "cable"}
    for name, who in (("SN-1", "mei"), ("SN-2", "jan")):
        found = find_note(both, name)
        assert found is not None
        assert found.who == who
    leave_note(HERE, URL, "ada", confirmed=True, controller="SN-2")
    clear_note({"elsewhere"}, "SN-1")
    assert find_note({"elsewhere"}, "SN-1") is None
    found = find_note(HERE)
    assert found is not None
    assert found.who == "ada", "a later stop at the same address"


@pytest.mark.usefixtures("robolink_state")
@pytest.mark.parametrize("record", ['{"nobody": 1}', "[]", "", "{", '"x"', "[" * 100_000])
def test_a_record_of_a_holder_that_is_damaged_names_nobody(record):
    assert LeaseView(holder=record).who() == LeaseHolder()


# The stopped state of an EPSON controller, and the answers that a stop accepts.
# On a controller that answers as instructed.

READY, RUNNING = "00100000001", "00100000010"


class Robot:
    """Moves until it was aborted this often; refuses a Stop meanwhile, or accepts it."""

    def __init__(self, *, aborts=1, shown=RUNNING, stop_refusal=21, abort_refusal=0):
        self.clock = ManualClock()
        self.asked = []
        self._aborts, self._shown = aborts, shown
        self._stop_refusal, self._abort_refusal = stop_refusal, abort_refusal

    @property
    def moving(self):
        return self.asked.count("Abort") < self._aborts

    def ask(self, name):
        self.asked.append(name)
        if name == "Abort" and self._abort_refusal:
            raise RejectedError("no Abort", code=self._abort_refusal)
        if name == "Stop" and self.moving and self._stop_refusal:
            if self._stop_refusal < 0:
                raise BusyError("an Execute of ours is unanswered")
            raise RejectedError("not now", code=self._stop_refusal)
        if name == "GetStatus":
            return Reply(name, (self._shown if self.moving else READY, "0000"))
        return Reply(name, ("0",))

    def stop(self):
        return bring_to_rest(self.ask, self.clock, controller="robot")


def test_the_first_frame_is_the_abort_and_one_of_each_is_enough():
    robot = Robot()
    flags, code = robot.stop()
    assert robot.asked == ["Abort", "Stop", "GetStatus"]
    assert (flags.running, code) == (False, 0)


@each_row("stop_refusal", [21, -1])
@each_row("shown", [RUNNING, READY])
def test_ready_flags_are_no_rest_while_an_execute_keeps_the_stop_out(shown, stop_refusal):
    robot = Robot(aborts=3, shown=shown, stop_refusal=stop_refusal)
    robot.stop()
    assert not robot.moving
    assert robot.asked.count("Abort") == 3


def test_a_stop_that_was_accepted_is_no_rest_while_the_flag_is_on():
    robot = Robot(aborts=2, stop_refusal=0)
    robot.stop()
    assert not robot.moving
    assert robot.asked.count("Stop") == 1


@pytest.mark.parametrize("shown", [RUNNING, READY])
@pytest.mark.fault("F76")
def test_no_rest_in_time_is_unknown(shown):
    robot = Robot(aborts=1000, shown=shown)
    with pytest.raises(OutcomeUnknownError, match="did not confirm within 5 s"):
        robot.stop()
    assert (REST_S - 0.5) * NS_PER_S < robot.clock.now_ns() < (REST_S + 0.5) * NS_PER_S
    assert robot.asked.count("Abort") >= 5


def test_firmware_without_abort_is_stopped_by_stop():
    robot = Robot(aborts=0, abort_refusal=11)
    robot.stop()
    assert robot.asked == ["Abort", "Stop", "GetStatus"]


def test_a_stop_that_is_not_allowed_is_an_error_at_once():
    robot = Robot(stop_refusal=20, aborts=5)
    with pytest.raises(RejectedError):
        robot.stop()


class Wire:
    """Gives one answer to anything sent, and then nothing."""

    url = identity = place = "robot"
    durable = False

    def __init__(self, *pieces):
        self.clock = ManualClock()
        self.sent = []
        self.closed = False
        self._pieces = list(pieces)

    def send(self, data, *, deadline, secret=False):
        self.sent.append(data)

    def receive(self, *, deadline):
        if not self._pieces:
            raise TransportTimeoutError("Nothing came.", remedy="Look at it.")
        return self._pieces.pop(0)

    def close(self):
        self.closed = True

    def receive_waiting(self):
        return None


def over(wire: Any) -> EpsonConversation:
    return EpsonConversation(text_line(wire), timeout_s=1.0)


LATE = b"#Execute,0\r\n"


@pytest.mark.fault("F01")
@pytest.mark.parametrize("answer", [b"#Abort,0\r\n", b"#ABORT,0\r\n"])
def test_a_stop_passes_over_what_it_did_not_ask_for(answer):
    wire = Wire(LATE * 15 + answer)
    reply = over(wire).exchange("Abort")
    assert (reply.name.lower(), reply.fields) == ("abort", ("0",))
    assert wire.sent == [b"$Abort\r\n"]


def test_who_only_ever_answers_something_else_is_no_controller():
    wire = Wire(LATE * 15 + b"#Abort,0\r\n", LATE * 15 + b"#Stop,0\r\n", LATE * 8, LATE * 8)
    conversation = over(wire)
    for name in ("Abort", "Stop"):  # each request has its own count
        assert conversation.exchange(name).fields == ("0",)
    with pytest.raises(RemoteProtocolError, match="robolink did not ask for"):
        conversation.exchange("GetStatus")


@each_row(
    "pieces",
    [(), (b"#GetCon",), (LATE * 16,), (b"",)],
)
def test_after_an_answer_that_was_given_up_nothing_more_is_sent(pieces):
    wire = Wire(*pieces)
    conversation = over(wire)
    with pytest.raises((TransportError, RemoteProtocolError)) as given_up:
        conversation.exchange("GetContNo")
    assert (given_up.value.controller, conversation.alive, wire.closed) == ("robot", False, True)
    with pytest.raises(TransportClosedError, match="has ended") as refused:
        conversation.exchange("Logout")
    assert refused.value.__cause__ is given_up.value
    assert wire.sent == [b"$GetContNo\r\n"]


def test_a_conversation_that_was_closed_stays_closed():
    wire = Wire(b"#Abort,0\r\n")
    conversation = over(wire)
    conversation.close()
    with pytest.raises(TransportClosedError):
        conversation.exchange("Abort")
    assert (wire.closed, wire.sent) == (True, [])


def test_a_refusal_without_a_name_is_the_answer_to_a_stop():
    with pytest.raises(RejectedError, match="refused Stop with code 20") as refused:
        over(Wire(b"!,20\r\n")).exchange("Stop")
    assert (refused.value.code, refused.value.request) == (20, "Stop")


def test_half_an_answer_to_a_stop_is_told_from_none():
    wire = Wire(b"#Abo")
    with pytest.raises(
        TransportTimeoutError, match=r"sent only 4 bytes of its answer\.\n    Abort"
    ):
        over(wire).exchange("Abort")


def test_a_stop_that_is_under_way_is_released_when_it_has_ended():
    latch, opened = StopLatch("cell"), threading.Event()

    def release():
        latch.release()
        opened.set()

    with latch.stopping():
        person = threading.Thread(target=release)
        person.start()
        assert not opened.wait(0.1)
        with pytest.raises(StoppedError):
            latch.admit(CommandClass.ACT, "Move")
    person.join(PATIENCE_S)
    assert opened.is_set()
    latch.admit(CommandClass.ACT, "Move")


def test_a_release_opens_no_stop_that_came_after_it_was_asked_for():
    """The person pressed once more while the first stop was still under way."""
    latch, told, waits = StopLatch("cell"), [], threading.Event()

    class Room(threading.Condition):
        """Tells that somebody is about to wait."""

        def wait_for(self, predicate, timeout=None):
            waits.set()
            return super().wait_for(predicate, timeout)

    latch._stops = Room()

    def release():
        try:
            latch.release()
        except StoppedError as refusal:
            told.append(str(refusal))

    with latch.stopping():
        person = threading.Thread(target=release)
        person.start()
        assert waits.wait(PATIENCE_S)
        latch.close()
    person.join(PATIENCE_S)
    assert "stopped once more" in told[0]
    assert latch.closed
    latch.release()
    assert not latch.closed


def test_a_release_that_was_asked_about_opens_nothing_that_came_since_the_question():
    latch = StopLatch("cell")
    latch.close()
    with pytest.raises(StoppedError), latch.calming("reset"):
        latch.close()
        latch.release()
    assert latch.closed
    with latch.calming("reset"):
        latch.release()
    assert not latch.closed


def interrupted(call, at, act):
    """Call a method with ``act`` before its instruction number ``at``, from 0, if it has one.

    Return whether it has. That is where another thread, or a signal handler, may come in.
    """
    begun = 0

    def step(frame, event, _value):
        nonlocal begun
        frame.f_trace_opcodes = True
        if event == "opcode":
            begun += 1
            if begun == at + 1:
                act()
        return step

    def enter(frame, _event, _value):
        if frame.f_code is not call.__func__.__code__:
            return None
        frame.f_trace_opcodes = True
        return step

    before = sys.gettrace()
    sys.settrace(enter)
    try:
        with suppress(StoppedError):
            call()
    finally:
        sys.settrace(before)
    return begun > at


def test_a_stop_at_any_instruction_of_a_release_stays():
    closed = []
    for at in count():
        latch = StopLatch("robot")
        latch.close()
        if not interrupted(latch.release, at, latch.close):
            break
        closed.append(latch.closed)
    assert len(closed) > 20
    # Only a stop of before its first look is one of those that are released.
    assert closed == sorted(closed)
    assert closed[len(closed) // 4]


def test_a_stop_is_not_lost_to_another_one_and_its_release_at_any_instruction():
    places = 0
    for at in count():
        latch, before = StopLatch("robot"), list[int]()

        def another(latch=latch, before=before):
            before.append(latch.closings)
            latch.close()
            latch.release()

        if not interrupted(latch.close, at, another):
            break
        if before == [0]:  # else this stop came first, and is released with the other one
            assert latch.closed
            places += 1
    assert places > 1


def test_a_latch_that_was_severed_stays_closed():
    latch = StopLatch("cell")
    latch.sever()
    latch.release()
    assert latch.closed
    assert latch.severed
