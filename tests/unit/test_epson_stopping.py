"""What counts as rest on an EPSON controller, and what a stop takes for its answer.

Against one that answers as it is told.
"""

from typing import Any

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.controllers.epson.line import EpsonConversation, text_line
from robolink.controllers.epson.rest import REST_S, bring_to_rest
from robolink.errors import (
    BusyError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportTimeoutError,
)
from robolink.protocols.epson_text import Reply
from robolink.timing import NS_PER_S

READY, RUNNING = "00100000001", "00100000010"


class Robot:
    """Moves until it was aborted so many times; refuses a Stop meanwhile, or not."""

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


@pytest.mark.parametrize("stop_refusal", [21, -1], ids=["refused", "held back here"])
@pytest.mark.parametrize("shown", [RUNNING, READY])
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
    with pytest.raises(OutcomeUnknownError, match="did not come to rest within 5 s"):
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
    """Says one thing whatever is sent, and then nothing."""

    identity = place = "robot"

    def __init__(self, *pieces):
        self.clock = ManualClock()
        self.sent = []
        self._pieces = list(pieces)

    def send(self, data, *, deadline, secret=False):
        self.sent.append(data)

    def receive(self, *, deadline):
        if not self._pieces:
            raise TransportTimeoutError("Nothing came.", remedy="Look at it.")
        return self._pieces.pop(0)


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
    wire = Wire(LATE * 8, LATE * 8, LATE + b"#Abort,0\r\n")
    conversation = over(wire)
    with pytest.raises(RemoteProtocolError, match="a question nobody asked"):
        conversation.exchange("Abort")
    # The next request has its own count, and what came late is none of its answers.
    assert conversation.exchange("Abort").fields == ("0",)


def test_a_refusal_without_a_name_is_the_answer_to_a_stop():
    with pytest.raises(RejectedError, match="refused Stop with code 20") as refused:
        over(Wire(b"!,20\r\n")).exchange("Stop")
    assert (refused.value.code, refused.value.request) == (20, "Stop")


def test_half_an_answer_to_a_stop_is_told_from_none():
    wire = Wire(b"#Abo")
    with pytest.raises(TransportTimeoutError, match="answered 4 bytes, then nothing: Abort"):
        over(wire).exchange("Abort")
