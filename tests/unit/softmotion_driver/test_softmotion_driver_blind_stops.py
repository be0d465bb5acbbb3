"""A stop reaches a PLC that can be written, but refuses to be looked at, or loses what is asked.

No look stands before what only ends a movement: its block is built on the last snapshot of the
session. What begins something still needs a look of its own.
"""

import itertools
import threading
from dataclasses import replace
from functools import partial

import pytest

from robolink.controllers import Jog, open_softmotion
from robolink.controllers.softmotion.commands import REST_S, CommandSender
from robolink.controllers.softmotion.snapshots import Snapshots
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import (
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportError,
    TransportTimeoutError,
)
from robolink.model import MotionProfile, Path, WorkBox
from robolink.protocols.mailbox import (
    Bits,
    Command,
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
    decode_command,
)
from robolink.stopping import _asking
from tests.unit.softmotion_driver._cell import PlcLink
from tests.unit.softmotion_driver._plc import MS, STRANGER

ANYWHERE = WorkBox()
SLOW = MotionProfile(Path.STRAIGHT, speed_mm_s=2.0)
ALONG_X = Jog(forward=frozenset({0}), speed_mm_s=3.0)
ALWAYS = 500


def refused(link: PlcLink, looks: int) -> None:
    for _ in range(looks):
        link.refuse("read_response")
        link.refuse("read_head")


def lost(link: PlcLink, looks: int) -> None:
    """A gateway has no answer of the PLC: it says so, and the link to it stays."""
    link.recovers = True
    for _ in range(looks):
        link.lose_request("read_response")
        link.lose_request("read_head")


def torn(link: PlcLink, looks: int) -> None:
    left = iter(range(looks))
    link.response = lambda words: tuple(words) if next(left, None) is None else (*words[:-1], 0)


@pytest.mark.parametrize("commands", [0, 1])
@pytest.mark.parametrize("unseen", [refused, lost, torn])
def test_a_stop_is_sent_whatever_becomes_of_the_looks(cell, plc, unseen, commands):
    controller = cell.met()
    for _ in range(commands):
        controller.take()
    plc.executed.clear()
    unseen(cell.link, ALWAYS)
    with pytest.raises((OutcomeUnknownError, TransportError, RemoteProtocolError)) as unconfirmed:
        controller.stop()
    assert "emergency stop" in unconfirmed.value.remedy
    assert plc.opcodes() == [Opcode.STOP]
    assert plc.now.group_state == GroupState.STOPPING


@pytest.mark.parametrize("commands", [0, 1])
@pytest.mark.parametrize("looks", [3, 12])
def test_a_stop_whose_looks_are_refused_for_a_while_is_confirmed(cell, plc, looks, commands):
    controller = cell.met()
    for _ in range(commands):
        controller.take()
    refused(cell.link, looks)
    controller.stop()
    assert controller._mailbox.wire.alive
    assert plc.opcodes()[commands:] == [Opcode.STOP, Opcode.STOP]  # again once it can be read


def test_a_stop_that_is_taken_and_never_shown_at_rest_is_unknown(cell, plc, controller):
    """It was acknowledged; from then on every look is refused."""
    cell.link.before("read_response", lambda: refused(cell.link, ALWAYS))
    with pytest.raises(OutcomeUnknownError, match="could not confirm") as unconfirmed:
        controller.stop()
    assert "emergency stop" in unconfirmed.value.remedy
    assert isinstance(unconfirmed.value.__cause__, RemoteProtocolError)
    assert plc.opcodes() == [Opcode.STOP]


def test_a_stop_of_which_nothing_is_shown_is_sent_once(cell, plc, controller):
    plc.answers = False
    refused(cell.link, ALWAYS)
    with pytest.raises(OutcomeUnknownError, match="could not confirm"):
        controller.stop()
    assert len(cell.link.sent) == 1
    assert controller._mailbox.wire.alive  # the next press goes out too


@pytest.mark.parametrize(("timeout_s", "answer_s"), [(0.5, 0.0), (30.0, 0.0), (3.0, 2.9)])
def test_no_stop_takes_longer_than_others_of_this_computer_wait_for_it(cell, timeout_s, answer_s):
    controller = open_softmotion(cell.link, outcomes=cell.outcomes, timeout_s=timeout_s)
    refused(cell.link, ALWAYS)
    cell.link.answer_s = answer_s
    began_ns = cell.plc.clock.now_ns()
    with pytest.raises(OutcomeUnknownError, match="could not confirm"):
        controller.stop()
    took_s = (cell.plc.clock.now_ns() - began_ns) / (1000 * MS)
    assert REST_S <= took_s < _asking._RESTS_S - 1


def test_a_stop_that_is_read_and_not_acknowledged_ends_in_time(cell):
    controller = open_softmotion(cell.link, outcomes=cell.outcomes, timeout_s=30.0)
    cell.plc.answers = False
    began_ns = cell.plc.clock.now_ns()
    with pytest.raises(TransportTimeoutError, match="not acknowledged"):
        controller.stop()
    assert cell.plc.clock.now_ns() - began_ns < (REST_S + 0.5) * 1000 * MS


@pytest.mark.parametrize("unseen", ["from the start", "from the acknowledgement"])
def test_a_session_that_is_over_ends_the_wait_for_a_stop(cell, controller, unseen):
    began_ns = cell.plc.clock.now_ns()
    if unseen == "from the start":
        torn(cell.link, ALWAYS)
    else:
        cell.link.before("read_response", partial(torn, cell.link, ALWAYS), nth=2)
    with pytest.raises(RemoteProtocolError, match="cannot be used"):
        controller.stop()
    assert cell.plc.clock.now_ns() - began_ns < 200 * MS


@pytest.mark.parametrize("act", ["halt", "interrupt"])
def test_what_ends_a_movement_is_sent_without_a_look_and_holds_nothing_up(
    cell, plc, controller, act
):
    """A stronger command follows at once, also from another thread: the lock is free."""
    group = controller.groups[0]
    here = group.pose()
    group.move_to(replace(here, z_mm=here.z_mm + 9), SLOW, box=ANYWHERE)
    refused(cell.link, ALWAYS)
    began_ns = plc.clock.now_ns()
    with pytest.raises(RemoteProtocolError, match="busy"):
        getattr(group, act)()
    assert plc.clock.now_ns() - began_ns < 50 * MS
    assert plc.opcodes()[-1] == Opcode[act.upper()]


def test_the_lock_is_free_while_a_stop_is_looked_for(cell, controller):
    free = []

    def another_thread():
        lock = controller._mailbox.commands._lock
        free.append(lock.acquire(timeout=0))
        lock.release()

    def looks():
        thread = threading.Thread(target=another_thread)
        thread.start()
        thread.join()

    refused(cell.link, 5)
    cell.link.before("read_head", looks)
    refused(cell.link, ALWAYS)
    with pytest.raises(OutcomeUnknownError):
        controller.stop()
    assert free == [True]


def test_a_jog_is_ended_that_can_no_longer_be_watched(cell, plc, controller):
    unseen_ns = []

    def unseen_from_here():
        unseen_ns.append(plc.clock.now_ns())
        assert plc.now.bits & Bits.JOGGING
        refused(cell.link, ALWAYS)

    cell.link.before("read_head", unseen_from_here, nth=20)
    with pytest.raises(RobolinkError):
        controller.groups[0].jog(ALONG_X, duration_s=30.0, box=ANYWHERE)
    assert plc.opcodes() == [Opcode.JOG, Opcode.JOG, Opcode.HALT, Opcode.STOP]
    assert plc.clock.now_ns() - unseen_ns[0] < 100 * MS
    assert plc.executed[1].only_ends
    assert len(cell.open_requests()) == 1  # nothing showed that it rests


def another(plc, *commands):
    """Let another client be acknowledged; it needs no ownership to stop."""
    for number, opcode in commands:
        plc.acknowledge(Command(number, opcode, owner=STRANGER), CommandState.DONE, 0)


def test_what_another_client_did_since_the_last_look_is_not_in_the_place_of_a_stop(
    cell, plc, controller
):
    another(plc, (900, Opcode.STOP))
    take_the_stop = cell.link.hold_up("write_command")
    cell.link.before("read_response", take_the_stop)
    controller.stop()
    assert plc.opcodes() == [Opcode.STOP]
    assert controller._mailbox.wire.alive


def test_a_stop_that_another_client_overwrites_is_written_again_at_once(cell, plc, controller):
    cell.link.hold_up("write_command")  # overwritten before the PLC has read it
    cell.link.before("read_head", lambda: another(plc, (901, Opcode.HALT)))
    begun_ns = plc.clock.now_ns()
    controller.stop()
    assert plc.clock.now_ns() - begun_ns < 50 * MS
    assert plc.opcodes() == [Opcode.STOP]
    assert len(cell.link.sent) == 2


@pytest.mark.parametrize("owned", [True, False])
def test_a_stop_that_another_client_hides_is_confirmed_at_once(cell, plc, controller, owned):
    """It was executed, and its acknowledgement overwritten before a look; its number is used up."""
    if owned:
        controller.take()
    plc.executed.clear()
    cell.link.before("read_head", lambda: another(plc, (901, Opcode.HALT)))
    began_ns = plc.clock.now_ns()
    controller.stop()
    assert plc.clock.now_ns() - began_ns < 200 * MS
    assert plc.opcodes() == [Opcode.STOP, Opcode.STOP]
    first, second = (command.sequence for command in plc.executed)
    assert first != second


@pytest.mark.parametrize("refused_first", [0, 2])
def test_a_stop_that_is_overwritten_again_and_again_is_written_until_it_is_taken(
    cell, plc, controller, refused_first
):
    for _ in range(refused_first):
        cell.link.refuse("write_command")
    for number in range(901, 905):
        cell.link.hold_up("write_command")
        cell.link.before("read_head", partial(another, plc, (number, Opcode.HALT)))
    begun_ns = plc.clock.now_ns()
    controller.stop()
    assert plc.clock.now_ns() - begun_ns < 300 * MS
    assert plc.opcodes() == [Opcode.STOP]
    assert len(cell.link.sent) == refused_first + 5


def test_a_stop_that_is_overwritten_for_ever_is_unproved_and_the_next_goes_out(
    cell, plc, controller
):
    write, others = cell.link.write_command, itertools.count(901)

    def overwritten(words, admit=lambda: None):
        cell.link.hold_up("write_command")
        write(words, admit)
        another(plc, (next(others), Opcode.HALT))

    cell.link.write_command = overwritten
    begun_ns = plc.clock.now_ns()
    with pytest.raises(OutcomeUnknownError, match="could not confirm") as unproved:
        controller.stop()
    assert REST_S <= (plc.clock.now_ns() - begun_ns) / (1000 * MS) < REST_S + 4
    assert "emergency stop" in unproved.value.remedy
    assert plc.executed == []
    cell.link.write_command = write
    controller.stop()
    assert plc.opcodes() == [Opcode.STOP]


@pytest.mark.parametrize("opcode", [Opcode.STOP, Opcode.HALT, Opcode.INTERRUPT, Opcode.JOG])
@pytest.mark.parametrize("times", [1, 3])
def test_what_ends_a_movement_and_got_lost_is_written_again(cell, plc, opcode, times):
    controller = open_softmotion(cell.link, outcomes=cell.outcomes, timeout_s=3.0)
    controller.take()
    plc.executed.clear()
    cell.link.sent.clear()
    for _ in range(times):
        cell.link.hold_up("write_command")  # written, and the PLC never sees it
    begun_ns = plc.clock.now_ns()
    if opcode == Opcode.STOP:
        controller.stop()
    else:
        controller._mailbox.commands.carry_out(Command(0, opcode))
    assert plc.clock.now_ns() - begun_ns < times * 450 * MS
    assert plc.opcodes() == [opcode]
    assert len({decode_command(words).sequence for words in cell.link.sent}) == len(cell.link.sent)


@pytest.mark.parametrize("opcode", [Opcode.STOP, Opcode.HALT, Opcode.INTERRUPT, Opcode.JOG])
@pytest.mark.parametrize("commands", [0, 1])
def test_an_early_end_of_anothers_number_is_no_refusal_of_ours(cell, plc, opcode, commands):
    """Ends carry no owner, and the last look is from before these: the next numbers of a count."""
    controller = cell.met()
    for _ in range(commands):
        controller.take()
    last = controller._mailbox.commands._last or plc.now.ack_head
    early = (Finished(last + 1 + n, CommandState.ERROR, ErrorClass.BUSY) for n in range(4))
    plc.executed.clear()
    plc.now = replace(plc.now, finished=tuple(early))
    another(plc, (900, Opcode.STOP))
    take_it = cell.link.hold_up("write_command")
    cell.link.before("read_head", take_it, nth=3)
    if opcode == Opcode.STOP:
        controller.stop()
    else:
        controller._mailbox.commands.carry_out(Command(0, opcode))
    assert opcode in plc.opcodes()


def test_a_stop_is_sent_again_as_long_as_it_alone_cannot_be_looked_at(cell, plc, controller):
    """Looks are refused whenever a block has just been written."""
    write = cell.link.write_command

    def refused_behind(words, admit=lambda: None):
        write(words, admit)
        refused(cell.link, 3)

    cell.link.write_command = refused_behind
    with pytest.raises(OutcomeUnknownError, match="could not confirm"):
        controller.stop()
    assert set(plc.opcodes()) == {Opcode.STOP}
    assert controller._mailbox.wire.alive


def test_a_stop_that_waited_long_for_its_turn_is_looked_for_once(cell, plc, controller):
    cell.link.before("read_response", partial(plc.clock.sleep, REST_S + 1))
    controller.stop()
    assert plc.opcodes() == [Opcode.STOP]


def test_a_damaged_stop_is_written_again(cell, plc, controller):
    damages = iter([lambda words: (*words[:20], words[20] ^ 1, *words[21:])])
    cell.link.command = lambda words: next(damages, tuple)(words)
    controller.stop()
    assert len(cell.link.sent) == 2
    assert plc.opcodes() == [Opcode.STOP]


@pytest.mark.parametrize("busy", [1, 2, 3, 12])
def test_a_stop_that_the_far_end_refuses_to_take_is_tried_again(cell, plc, controller, busy):
    """A refused write was not done. The first two follow at once, the others 40 ms apart."""
    for _ in range(busy):
        cell.link.refuse("write_command")
    begun_ns = plc.clock.now_ns()
    controller.stop()
    assert (plc.clock.now_ns() - begun_ns) / MS < 40 * max(0, busy - 2) + 30
    assert plc.opcodes() == [Opcode.STOP]
    assert len(cell.link.sent) == busy + 1


def test_a_stop_that_the_far_end_never_takes_is_refused_and_the_next_is_tried_too(
    cell, plc, controller
):
    for _ in range(ALWAYS):
        cell.link.refuse("write_command")
    for _ in range(2):
        cell.link.sent.clear()
        begun_ns = plc.clock.now_ns()
        with pytest.raises(RejectedError, match="busy") as failure:
            controller.stop()
        assert "emergency stop" in failure.value.remedy
        assert 1.0 <= (plc.clock.now_ns() - begun_ns) / (1000 * MS) < 1.2
        assert 20 < len(cell.link.sent) < 40


@pytest.mark.parametrize("opcode", [Opcode.HALT, Opcode.INTERRUPT, Opcode.JOG])
def test_a_weaker_end_that_is_refused_leaves_time_for_a_stop(cell, plc, controller, opcode):
    controller.take()
    cell.link.sent.clear()
    for _ in range(ALWAYS):
        cell.link.refuse("write_command")
    begun_ns = plc.clock.now_ns()
    with pytest.raises(RejectedError, match="busy"):
        controller._mailbox.commands.carry_out(Command(0, opcode))
    assert plc.clock.now_ns() - begun_ns < 20 * MS
    assert len(cell.link.sent) == 3


def test_what_does_not_only_end_something_is_never_written_again(cell, plc, controller):
    controller.take()
    plc.executed.clear()
    cell.link.sent.clear()
    cell.link.refuse("write_command")
    with pytest.raises(RejectedError, match="busy"):
        controller._mailbox.commands.carry_out(Command(0, Opcode.ENABLE))
    assert len(cell.link.sent) == 1
    assert plc.executed == []


def test_what_begins_something_still_needs_a_look(cell, plc, controller):
    group, here = controller.groups[0], controller.groups[0].pose()
    plc.clock.sleep(1.0)
    refused(cell.link, ALWAYS)
    with pytest.raises(RemoteProtocolError, match="busy"):
        group.move_to(replace(here, z_mm=here.z_mm + 9), SLOW, box=ANYWHERE)
    with pytest.raises(RemoteProtocolError, match="busy"):
        controller.reset_fault()
    assert cell.link.sent == []


def test_a_far_end_that_showed_no_mailbox_is_told_nothing(cell):
    refused(cell.link, ALWAYS)
    wire = MailboxWire(cell.link, owner=7, timeout_s=0.5)
    with pytest.raises(RejectedError, match="busy"):
        CommandSender(wire, Snapshots(wire)).bring_to_rest()
    assert cell.link.sent == []


def test_a_stop_stops_what_moves_on_a_plc_that_has_started_anew(cell, plc, controller):
    """Its last start is not named; another client may move it by now."""
    plc.restart()
    with pytest.raises(TransportBrokenError, match="restarted"):
        controller.stop()
    assert plc.opcodes() == [Opcode.STOP]
    assert plc.now.group_state == GroupState.STOPPING
    assert plc.now.error_class == 0


def test_what_acts_names_the_start_that_was_met(cell, plc, controller):
    """Whatever a PLC does that has started anew since, no command of before moves it."""
    met = plc.now.boot_id
    cell.link.before("write_command", plc.restart)
    with pytest.raises((TransportBrokenError, RejectedError, OutcomeUnknownError)):
        controller.groups[0].move_to(
            replace(controller.groups[0].pose(), z_mm=290.0), SLOW, box=ANYWHERE
        )
    assert decode_command(cell.link.sent[-1]).boot_id == met
    assert plc.now.error_class == ErrorClass.OTHER_BOOT
