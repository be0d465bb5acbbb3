"""Commands to a PLC mailbox: whose answer counts, and when a block is written again."""

from dataclasses import replace
from itertools import count

import pytest

from robolink.controllers.softmotion import answers
from robolink.controllers.softmotion.condition import has_stayed
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    NotReadyError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    StoppedError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.model import Act, Verdict
from robolink.protocols.mailbox import (
    COMMAND_WORDS,
    Bits,
    Command,
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
)
from tests.unit.softmotion_driver._cell import PlcLink
from tests.unit.softmotion_driver._plc import MS, STRANGER


def corrupt(words):
    return (*words[:20], words[20] ^ 1, *words[21:])


def test_each_command_has_a_new_number_the_owner_the_epoch_and_the_plc_start(plc, controller):
    controller.io.read_input(3)
    controller.io.read_input(3)
    first, second = plc.executed
    assert second.sequence == first.sequence + 1
    assert (first.owner, first.epoch, first.boot_id) == (plc.owner, plc.epoch, plc.now.boot_id)


def test_a_number_that_the_plc_still_shows_is_not_used(cell, plc):
    plc.now = replace(plc.now, finished=(Finished(41, 10, 0), Finished(42, 10, 0)) * 2)
    cell.met().take()
    assert plc.executed[0].sequence == 43


@pytest.mark.fault("F29")
def test_numbers_go_on_behind_the_last_one_and_skip_zero(cell, plc):
    plc.now = replace(plc.now, ack_head=65535)
    cell.met().take()
    assert plc.executed[0].sequence == 1


def test_an_input_is_read(plc, controller):
    plc.inputs[4] = 4711
    assert controller.io.read_input(3)
    assert not controller.io.read_input(5)
    assert controller.io.read_value(4) == 4711


def test_a_damaged_block_is_written_again_once_the_plc_says_so(cell, plc, controller):
    damages = iter([corrupt, tuple])
    cell.link.command = lambda words: next(damages)(words)
    assert controller.io.read_input(3) == 1
    first, second = cell.link.sent
    assert first == second
    assert plc.opcodes() == [Opcode.READ_INPUT]


def test_a_block_that_stays_damaged_is_given_up(cell, plc, controller):
    flips = iter(range(1, 9))

    def damage(words):
        # The PLC counts a damaged block once, by its number and its checksum.
        return (*words[:61], words[61] ^ next(flips), *words[62:])

    cell.link.command = damage
    with pytest.raises(RemoteProtocolError, match="damaged each time"):
        controller.io.read_input(3)
    assert len(cell.link.sent) == 3
    assert plc.executed == []


def test_a_silent_plc_gets_no_second_block(cell, plc, controller):
    plc.answers = False
    with pytest.raises(TransportTimeoutError, match="not acknowledged"):
        controller.io.read_input(3)
    assert len(cell.link.sent) == 1
    assert cell.link.closed


@pytest.mark.fault("F25", "F26")
def test_a_lost_answer_to_the_write_is_not_followed_by_another_write(cell, plc, controller):
    cell.link.recovers = True
    cell.link.lose_answer("write_command")
    with pytest.raises(TransportTimeoutError):
        controller.io.read_input(3)
    assert len(cell.link.sent) == 1


def test_an_acknowledgement_for_another_client_makes_the_command_unknown(cell, plc, controller):
    stranger = Command(77, Opcode.HALT, owner=STRANGER)
    cell.link.before("read_head", lambda: plc.acknowledge(stranger, CommandState.DONE, 0), nth=1)
    with pytest.raises(OutcomeUnknownError, match="another client"):
        controller.io.set_output(5, 1)
    assert len(cell.open_requests()) == 1


def test_an_acknowledgement_of_another_opcode_is_not_taken_as_ours(cell, plc, controller):
    def echo_another():
        plc.now = replace(plc.now, opcode_echo=Opcode.HALT)

    cell.link.before("read_head", echo_another)
    with pytest.raises(OutcomeUnknownError):
        controller.io.set_output(5, 1)


def test_a_plc_that_starts_anew_in_the_middle_of_a_command_leaves_it_unknown(cell, plc, controller):
    cell.link.before("read_head", plc.restart)
    with pytest.raises(OutcomeUnknownError, match="restarted"):
        controller.io.set_output(5, 1)
    assert len(cell.open_requests()) == 1


@pytest.mark.fault("F14", "F29")
def test_a_plc_that_started_anew_before_a_command_is_told_nothing(cell, plc, controller):
    plc.restart()
    with pytest.raises(TransportBrokenError, match="restarted"):
        controller.io.set_output(5, 1)
    assert cell.link.sent == []
    cell.connect()
    assert cell.open_requests() == []


def test_an_output_is_written_and_marked(cell, plc, controller):
    controller.io.set_output(5, 1)
    assert plc.outputs == {5: 1}
    assert cell.open_requests() == []


def test_an_output_in_doubt_is_for_a_person_to_look_at(cell, controller):
    cell.link.lose_answer("write_command")
    with pytest.raises(OutcomeUnknownError):
        controller.io.set_output(5, 1)
    later = cell.connect()
    (marker,) = cell.outcomes.open_markers()
    assert later.resolver.examine(marker).verdict is Verdict.LOOK


def test_a_value_that_does_not_fit_is_not_sent(cell, controller):
    with pytest.raises(ConfigError, match="does not fit"):
        controller.io.read_input(40000)
    assert cell.link.sent == []


def test_every_refusal_names_its_meaning_and_a_remedy(plc, controller):
    for error in ErrorClass:
        if error in (ErrorClass.NONE, ErrorClass.NOT_OWNER, ErrorClass.STALE_EPOCH):
            continue
        plc.refusals[Opcode.READ_INPUT] = error
        with pytest.raises(RejectedError, match=str(int(error))) as refusal:
            controller.io.read_input(3)
        assert refusal.value.code == error
        assert refusal.value.remedy


def test_a_number_of_the_plc_s_own_is_told_of_the_error_that_it_belongs_to_alone(plc, controller):
    plc.now = replace(plc.now, error_class=ErrorClass.DISABLED, raw_error=4711)
    own = answers._meaning(ErrorClass.DISABLED, plc.now)
    other = answers._meaning(ErrorClass.MOVING, plc.now)
    assert "ErrorID 4711" in own
    assert "ErrorID" not in other


def test_a_command_that_a_stop_ends_is_not_taken_as_done(cell, plc, controller):
    def stop_it():
        ours = plc.executed[-1]
        end = Finished(ours.sequence, CommandState.ABORTED, 0)
        plc.now = replace(plc.now, finished=(end, *plc.now.finished[:3]))
        plc.acknowledge(
            Command(ours.sequence + 1, Opcode.STOP, owner=plc.owner), CommandState.DONE, 0
        )

    def still_active():
        plc.now = replace(plc.now, state=CommandState.ACTIVE)

    cell.link.before("read_head", still_active)
    cell.link.before("read_head", stop_it)
    with pytest.raises(ControllerFaultError, match="ended before it finished"):
        controller.motors(False)


@pytest.mark.parametrize(("lasts_ms", "looks"), [(4, 5), (40, 18), (250, 30), (2000, 80)])
def test_an_end_is_noticed_soon_and_a_long_wait_costs_few_questions(
    cell, plc, controller, lasts_ms, looks
):
    asked_ns = []

    def read_head():
        asked_ns.append(plc.clock.now_ns())
        ended = asked_ns[-1] - asked_ns[0] >= lasts_ms * MS
        plc.now = replace(plc.now, state=CommandState.DONE if ended else CommandState.ACTIVE)
        return PlcLink.read_head(cell.link)

    cell.link.read_head = read_head
    controller.io.read_input(3)
    late_ms = (asked_ns[-1] - asked_ns[0]) / MS - lasts_ms
    assert late_ms <= min(lasts_ms / 4, 40)
    assert looks * 0.8 <= len(asked_ns) <= looks


@pytest.mark.parametrize("wait_s", [0.05, 0.12, 0.21, 0.3])
def test_a_wait_without_news_ends_when_it_is_over(plc, controller, wait_s):
    # A jog is released then, however long the pause between two readings.
    snapshots = controller._mailbox.snapshots
    now, begun_ns = snapshots.take(), plc.clock.now_ns()
    snapshots.news(now, wait_s=wait_s)
    waited_s = (plc.clock.now_ns() - begun_ns) / 1e9
    assert wait_s <= waited_s < wait_s + 0.005


def test_enabling_is_proved_and_not_repeated(plc, controller):
    plc.now = replace(plc.now, group_state=GroupState.DISABLED)
    controller.motors(True)
    controller.motors(True)
    assert plc.opcodes() == [Opcode.ENABLE]
    controller.motors(False)
    assert plc.opcodes() == [Opcode.ENABLE, Opcode.DISABLE]


def test_a_reset_clears_the_error_and_sends_nothing_without_one(plc, controller):
    controller.reset_fault()
    assert plc.executed == []
    plc.now = replace(plc.now, group_state=GroupState.ERRORSTOP)
    controller.reset_fault()
    assert plc.opcodes() == [Opcode.RESET]
    assert controller.status().ready


def test_a_held_stop_is_released_by_the_reset(plc, controller):
    controller.stop()
    controller.stop()
    assert controller.status().paused
    controller.reset_fault()
    assert controller.status().ready
    assert [command.operands[0] for command in plc.executed] == [0, 0, 1]


def test_a_held_stop_is_not_released_without_the_machines_permit(plc, controller):
    controller.stop()
    plc.now = replace(plc.now, bits=plc.now.bits & ~Bits.PERMITTED)
    with pytest.raises(NotReadyError, match="does not permit"):
        controller.reset_fault()
    assert [command.operands[0] for command in plc.executed] == [0]


def test_stopping_needs_no_ownership(cell, plc):
    plc.owner = STRANGER
    cell.met().stop()
    assert plc.now.group_state == GroupState.STOPPING


def test_a_stop_that_is_refused_because_one_holds_already_is_a_stop(plc, controller):
    plc.refusals[Opcode.STOP] = ErrorClass.STOPPING
    controller.stop()


def test_a_group_whose_axes_go_on_after_its_stop_was_not_stopped(cell, plc, controller):
    """The PLC reports that a stop is active, and five seconds later the axes still turn."""
    plc.refusals[Opcode.STOP] = ErrorClass.STOPPING
    read, turned_deg = cell.link.read_response, count()

    def turning():
        first, *others = plc.now.axes
        plc.now = replace(plc.now, axes=(first + next(turned_deg), *others))
        return read()

    cell.link.read_response = turning
    with pytest.raises(OutcomeUnknownError, match="could not confirm") as unconfirmed:
        controller.stop()
    assert "press the emergency stop" in unconfirmed.value.remedy


@pytest.mark.parametrize(
    ("unit_um", "a_look", "rests"),
    [
        (1000.0, 0.3, False),
        (1000.0, 0.001, True),
        (1e6, 0.03, False),  # of metres: 0.3 m/s
        (1e6, 1e-6, True),
        (1.0, 0.3, False),
        (1.0, 0.01, True),
    ],
)
def test_an_axis_stands_by_the_unit_in_which_the_plc_counts(plc, unit_um, a_look, rests):
    before = replace(plc.now, unit_um=unit_um, plc_heartbeat=1)
    now = replace(before, axes=(a_look, *before.axes[1:]), plc_heartbeat=2)
    assert has_stayed(before, now) is rests
    assert not has_stayed(before, replace(before, axes=before.axes))


def test_a_stop_that_is_not_confirmed_names_the_emergency_stop(plc, controller):
    plc.answers = False
    with pytest.raises(TransportTimeoutError) as failure:
        controller.stop()
    assert "emergency stop" in failure.value.remedy


def test_a_stop_is_confirmed_where_the_plc_takes_the_command_before_it_late(cell, plc, controller):
    """Its cycle came between the stop's own look and its block; that is no other client."""
    for _ in range(3):
        cell.link.refuse("read_head")
    take_the_output = cell.link.hold_up("write_command")
    with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
        controller.io.set_output(5, 1)
    cell.link.before("read_head", take_the_output)
    take_the_stop = cell.link.hold_up("write_command")
    cell.link.before("read_head", take_the_stop)
    controller.stop()
    assert plc.opcodes() == [Opcode.WRITE_OUTPUT, Opcode.STOP]
    assert plc.now.group_state == GroupState.STOPPING


def test_a_stop_that_only_an_earlier_command_answers_is_not_confirmed(cell, plc, controller):
    for _ in range(3):
        cell.link.refuse("read_head")
    take_the_output = cell.link.hold_up("write_command")
    with pytest.raises(OutcomeUnknownError):
        controller.io.set_output(5, 1)
    cell.link.before("read_head", take_the_output)
    for _ in range(100):
        cell.link.hold_up("write_command")
    with pytest.raises(TransportTimeoutError, match="not acknowledged") as unconfirmed:
        controller.stop()
    assert "press the emergency stop" in unconfirmed.value.remedy
    assert plc.opcodes() == [Opcode.WRITE_OUTPUT]


REFUSED, LOST = PlcLink.refuse, PlcLink.lose_answer


@pytest.mark.parametrize(
    "looks",
    [
        (REFUSED, REFUSED, REFUSED),
        (LOST, REFUSED, REFUSED, REFUSED),
        (REFUSED, REFUSED, LOST, REFUSED),
        (LOST, REFUSED, LOST, REFUSED, REFUSED),
    ],
    ids=lambda looks: "-".join(look.__name__ for look in looks),
)
def test_looks_that_are_refused_leave_a_serial_line_for_the_stop(cell, plc, controller, looks):
    """Each of them is an answer: the line has found its place again, whatever was lost before."""
    cell.link.recovers = True
    controller.io.read_input(3)
    for look in looks:
        look(cell.link, "read_response")
    with pytest.raises(RemoteProtocolError, match="busy"):
        controller.status()
    controller.stop()
    assert plc.now.group_state == GroupState.STOPPING


@pytest.mark.parametrize(
    ("recovers", "looks"),
    [(False, (REFUSED, LOST)), (True, (LOST, REFUSED, LOST, REFUSED, LOST))],
    ids=["network", "serial"],
)
def test_looks_that_nothing_answers_end_the_session_although_others_were_refused(
    cell, plc, controller, recovers, looks
):
    cell.link.recovers = recovers
    controller.io.read_input(3)
    for look in looks:
        look(cell.link, "read_response")
    with pytest.raises(TransportTimeoutError):
        controller.status()
    with pytest.raises(TransportClosedError):
        controller.status()
    assert cell.link.closed


def test_a_block_that_a_stop_held_back_was_not_sent(cell):
    wire = MailboxWire(cell.link, owner=7, timeout_s=0.5)

    def stopped():
        raise StoppedError("stopped", remedy="release it")

    with pytest.raises(StoppedError):
        wire.write((0,) * COMMAND_WORDS, stopped)
    assert (wire.commands, wire.exchanges) == (0, 0)
    cell.link.refuse("read_response")
    with pytest.raises(RejectedError):
        wire.read_response()


def test_an_error_that_stays_after_the_reset_is_told(cell, plc, controller):
    plc.now = replace(plc.now, group_state=GroupState.ERRORSTOP)

    def error_again():
        plc.now = replace(plc.now, group_state=GroupState.ERRORSTOP)

    for _ in range(100):
        cell.link.before("read_head", error_again)
        cell.link.before("read_response", error_again)
    with pytest.raises(ControllerFaultError, match="still in the same state"):
        controller.reset_fault()


def test_a_preview_of_an_act_names_its_commands(cell, plc, controller):
    assert controller.preview(Act.STOP) == ("2003 STOP",)
    assert controller.preview(Act.MOTORS_ON) == ("1000 ENABLE",)
    assert controller.preview(Act.MOTORS_OFF) == ("1002 DISABLE",)
    assert controller.preview(Act.RESET) == ()
    plc.now = replace(plc.now, group_state=GroupState.STOPPING)
    assert controller.preview(Act.RESET) == ("2003 STOP 1",)
    assert cell.link.sent == []


def test_the_condition_says_what_an_error_means(plc, controller):
    plc.now = replace(
        plc.now, group_state=GroupState.ERRORSTOP, error_class=ErrorClass.AXIS, tool_slot=3
    )
    found = controller.condition()
    assert found["text"] == "an axis or its drive is in error"
    assert (found["selected_tool"], found["motors_on"]) == (3, True)


def test_an_owner_that_only_waits_gives_a_sign_now_and_then(cell, plc, controller):
    for _ in range(12):
        plc.clock.sleep(1.0)
        controller.status()
    assert len(cell.link.beats) >= 11
    assert all(word >> 8 == plc.epoch & 0xFF for word in cell.link.beats)
    assert len(set(cell.link.beats)) == len(cell.link.beats)
