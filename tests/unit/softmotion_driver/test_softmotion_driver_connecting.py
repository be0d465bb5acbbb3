"""Connecting to a PLC mailbox, and a PLC behind the interfaces of procedures and tool changes."""

import re
from dataclasses import replace

import pytest

from robolink.controllers import SoftMotionController, connect
from robolink.controllers.softmotion import controller as softmotion
from robolink.errors import (
    ConnectError,
    LeaseHeldError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.model import ControllerState, MotionProfile, Path, ToolOffset, Verdict, WorkBox
from robolink.protocols.mailbox import Bits, Capability, ErrorClass, GroupState, Opcode, crc16
from robolink.runner import Question, Runner, RunSettings
from robolink.transaction import ToolChange, Wanted, change_tools, look, recover

# Connecting to a PLC mailbox: version, probe, heartbeat, whole snapshots
# (docs/reference/mailbox.md).


def resealed(words):
    """Return the words with the checksum that belongs to them."""
    return (*words[:110], crc16(words[:110]), words[111])


def test_meeting_a_mailbox_writes_nothing(cell):
    with cell.met() as controller:
        controller.status()
        controller.tools.read_all()
        controller.groups[0].pose()
    assert cell.link.sent == []
    assert cell.link.beats == []


def test_a_wrong_word_order_is_named_and_nothing_is_written(cell):
    def big_end_first(words):
        probe = slice(84, 88)
        return resealed((*words[:84], *reversed(words[probe]), *words[88:]))

    cell.link.response = big_end_first
    with pytest.raises(RemoteProtocolError, match="high word first"):
        cell.met()
    assert cell.link.sent == []
    assert cell.link.closed


@pytest.mark.fault("F33")
def test_swapped_bytes_in_every_word_are_named(cell):
    cell.link.response = lambda words: tuple((word & 0xFF) << 8 | word >> 8 for word in words)
    with pytest.raises(RemoteProtocolError, match="bytes swapped"):
        cell.met()


@pytest.mark.fault("F34")
@pytest.mark.parametrize("shift", [1, -1, 4])
def test_a_shifted_map_is_named_with_its_distance(cell, shift):
    cell.link.response = lambda words: (*words[-shift:], *words[:-shift])
    with pytest.raises(RemoteProtocolError, match=re.escape(f"{shift:+d} registers")):
        cell.met()


def test_a_map_without_a_probe_is_refused(cell):
    cell.plc.now = replace(cell.plc.now, probe=1.0)
    with pytest.raises(RemoteProtocolError, match="probe value is missing"):
        cell.met()


def test_another_major_version_is_refused(cell):
    cell.plc.now = replace(cell.plc.now, version=0x0200)
    with pytest.raises(RemoteProtocolError, match="another major version"):
        cell.met()


def test_an_empty_block_is_no_mailbox(cell):
    cell.link.response = lambda words: (0,) * len(words)
    with pytest.raises(RemoteProtocolError, match="no mailbox program has filled it"):
        cell.met()


@pytest.mark.parametrize(("field", "value"), [("boot_id", 0), ("unit_um", 0.0)])
def test_a_block_with_an_impossible_value_is_refused(cell, field, value):
    cell.plc.now = replace(cell.plc.now, **{field: value})
    with pytest.raises(RemoteProtocolError, match=field):
        cell.met()


def test_a_heartbeat_that_stands_still_is_found_on_connecting(cell):
    cell.plc.frozen = True
    with pytest.raises(ConnectError, match="is not running"):
        cell.met()
    assert cell.link.closed


@pytest.mark.fault("F31")
def test_a_torn_snapshot_is_read_again(cell):
    controller = cell.met()
    torn = iter([True, True, False])
    cell.link.response = lambda words: (*words[:-1], 9) if next(torn) else words
    assert controller.status().ready


@pytest.mark.fault("F31")
def test_f31_a_snapshot_that_stays_corrupt_ends_the_session(cell):
    controller = cell.met()
    reads = []

    def corrupt(words):
        reads.append(words)
        return (*words[:20], words[20] ^ 1, *words[21:])

    cell.link.response = corrupt
    with pytest.raises(RemoteProtocolError, match="checksum"):
        controller.status()
    assert len(reads) == 3
    assert cell.link.closed


def test_a_line_that_recovers_is_asked_again(cell):
    cell.link.recovers = True
    controller = cell.met()
    cell.link.lose_answer("read_response")
    assert controller.status().ready


@pytest.mark.fault("F11")
def test_a_line_that_stays_silent_is_asked_once_more_when_the_deadline_has_passed(cell):
    cell.link.recovers = True
    controller = cell.met()
    asked = []

    def silence(_deliver):
        asked.append(cell.link.clock.now_ns())
        cell.link.clock.advance(10.0)
        raise cell.link.silence()

    for _ in range(3):
        cell.link.plan("read_response", silence)
    with pytest.raises(TransportTimeoutError):
        controller.status()
    assert len(asked) == 2
    assert cell.link.closed


def test_a_link_that_does_not_recover_is_not_asked_again(cell):
    controller = cell.met()
    cell.link.lose_answer("read_response")
    with pytest.raises(TransportTimeoutError):
        controller.status()


def test_a_plc_that_started_anew_ends_the_session(cell):
    controller = cell.met()
    cell.plc.restart()
    with pytest.raises(TransportBrokenError, match="restarted"):
        controller.status()
    assert cell.link.closed


def cut_by(cell, *, restarted):
    """Cut the link, by a restart of the PLC as over TCP, or for another reason."""

    def mishap(_deliver):
        if restarted:
            cell.plc.restart()
        cell.link.close()
        raise TransportBrokenError("The connection was closed.", remedy="connect again")

    return mishap


@pytest.mark.parametrize(
    ("restarted", "reachable", "sentence"),
    [
        (True, True, "restarted"),
        (True, False, "connection was closed"),
        (False, True, "connection was closed"),
    ],
)
@pytest.mark.parametrize("method", ["read_response", "write_command"])
def test_a_start_that_cuts_the_link_is_told_as_one_if_the_plc_answers_again(
    cell, method, restarted, reachable, sentence
):
    controller = cell.met()
    cell.link.reachable = reachable
    cell.link.plan(method, cut_by(cell, restarted=restarted))
    with pytest.raises(TransportBrokenError, match=sentence) as broken:
        controller.take() if method == "write_command" else controller.status()
    assert broken.value.controller == controller.identity
    assert cell.plc.executed == []
    with pytest.raises(TransportClosedError):
        controller.status()


def test_another_unit_of_length_ends_the_session(cell):
    controller = cell.met()
    cell.plc.now = replace(cell.plc.now, unit_um=25400.0)
    with pytest.raises(TransportBrokenError, match="unit of length"):
        controller.groups[0].pose()


@pytest.mark.parametrize(
    ("state", "bits", "expected"),
    [
        (GroupState.STANDBY, Bits.PERMITTED | Bits.POWERED, ControllerState.READY),
        (GroupState.DISABLED, Bits.PERMITTED | Bits.POWERED, ControllerState.DISABLED),
        (GroupState.DISABLED, Bits.PERMITTED, ControllerState.NO_POWER),
        (GroupState.STANDBY, Bits.PERMITTED, ControllerState.NO_POWER),
        (GroupState.STANDBY, Bits(0), ControllerState.NOT_REMOTE),
        (GroupState.ERRORSTOP, Bits.PERMITTED, ControllerState.FAULT),
        (GroupState.STOPPING, Bits.PERMITTED, ControllerState.PAUSED),
        (GroupState.STANDBY, Bits.PERMITTED | Bits.INTERRUPTED, ControllerState.PAUSED),
        (GroupState.HOMING, Bits.PERMITTED | Bits.POWERED, ControllerState.RUNNING),
    ],
)
def test_the_group_state_is_told_in_the_words_of_all_controllers(cell, state, bits, expected):
    cell.plc.now = replace(cell.plc.now, group_state=state, bits=bits)
    status = cell.met().status()
    assert status.state is expected
    assert status.ready is (expected is ControllerState.READY)


def test_the_facts_name_the_kinematics_and_the_version(cell):
    controller = cell.met()
    facts = controller.mailbox_facts()
    assert (facts.kinematics, facts.axis_count, facts.version) == ("Kin_Scara3_Z", 4, "1.0")
    assert controller.facts().robot_models == ("Kin_Scara3_Z",)


def test_a_mailbox_with_the_tools_profile_moves_nothing(cell):
    cell.plc.now = replace(cell.plc.now, capabilities=Capability.TOOLS)
    able = cell.met().capabilities
    assert able.tool_write
    assert not able.motion


def test_positions_are_converted_from_the_plcs_units(cell):
    cell.plc.now = replace(cell.plc.now, unit_um=25400.0, tcp=(1.0, 2.0, 3.0, 0.0, 90.0, 0.0))
    pose = cell.met().groups[0].pose()
    assert (pose.x_mm, pose.z_mm) == pytest.approx((25.4, 76.2))
    assert pose.v_deg == pytest.approx(90.0)


def test_a_position_that_is_no_number_is_not_believed(cell):
    cell.plc.now = replace(cell.plc.now, tcp=(float("nan"), 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(RemoteProtocolError, match="not a number"):
        cell.met().groups[0].pose()


# A PLC behind the interfaces that procedures and tool changes use, and behind its URL.

OLD = ToolOffset(1.5, -2.0, 40.0, 10.0)
NEW = ToolOffset(1.7, -2.1, 40.3, 20.0)


class Nobody:
    """An operator who is never asked."""

    def tell(self, text: str) -> None:
        """Ignore a message."""

    def ask(self, question: str, kind: Question) -> None:
        """Ignore a question."""
        raise AssertionError(question)

    def poll(self, wait_s: float) -> str | None:
        """Answer nothing."""
        return None


@pytest.fixture
def controller(cell):
    controller = cell.met()
    controller.tools.write(3, OLD, expected=None)
    return controller


def test_two_tools_change_together(cell, controller):
    change_tools(controller, [Wanted(3, NEW, OLD), Wanted(4, NEW, None)])
    assert controller.tools.same(controller.tools.read(3), NEW)
    assert controller.tools.same(controller.tools.read(4), NEW)
    assert cell.open_requests() == []


def test_a_change_that_is_refused_half_way_is_taken_back(cell, controller):
    with (
        pytest.raises(RejectedError),
        ToolChange(controller, [Wanted(3, NEW, OLD), Wanted(4, NEW, None)]) as change,
    ):
        cell.link.before(
            "write_command",
            lambda: cell.plc.refusals.update({Opcode.WRITE_TOOL: ErrorClass.TOOL_INCOMPATIBLE}),
            nth=2,
        )
        cell.link.before("write_command", cell.plc.refusals.clear)
        change.write()
    assert controller.tools.same(controller.tools.read(3), OLD)
    assert controller.tools.read(4) is None
    assert cell.open_requests() == []


def test_a_change_cut_off_in_the_middle_is_recovered(cell, controller):
    cell.link.lose_request("write_command", nth=2)
    with pytest.raises(OutcomeUnknownError):
        change_tools(controller, [Wanted(3, NEW, OLD), Wanted(4, NEW, None)])
    controller.close()
    later = cell.connect()
    recover(later)
    assert later.tools.same(later.tools.read(3), OLD)
    assert later.tools.read(4) is None
    assert cell.open_requests() == []


def held_up(cell, controller):
    """Let a write of tool 3 be given up; return a function that lets it arrive."""
    held = []

    def mishap(deliver):
        held.append(deliver)
        raise cell.link.silence()

    cell.link.plan("write_command", mishap)
    with pytest.raises(OutcomeUnknownError):
        controller.tools.write(3, NEW, expected=OLD)
    return held[0]


def test_a_write_that_arrives_behind_its_recovery_is_not_carried_out(cell, controller):
    arrive = held_up(cell, controller)
    later = cell.connect()
    recover(later)
    assert cell.open_requests() == []
    arrive()
    assert later.tools.same(later.tools.read(3), OLD)
    assert cell.plc.now.error_class == ErrorClass.NOT_OWNER


def test_a_look_at_what_is_open_sends_no_command(cell, controller):
    held_up(cell, controller)
    (finding,) = look(cell.connect())
    assert finding.verdict is Verdict.NOT_APPLIED
    assert cell.link.sent == []


def test_nothing_is_settled_while_another_client_has_the_mailbox(cell, controller):
    held_up(cell, controller)
    later, clock = cell.connect(), cell.plc.clock
    cell.plc.owner, cell.plc.refusals[Opcode.OWNERSHIP] = 0xCAFE0001, ErrorClass.NOT_OWNER
    began_ns = clock.now_ns()
    with pytest.raises(LeaseHeldError, match="CAFE0001"):
        recover(later)
    assert 10 < (clock.now_ns() - began_ns) / 1e9 < 15
    assert len(cell.open_requests()) == 1
    assert len(cell.link.sent) == 2  # it asks twice, and does not get in that client's way


def test_a_recovery_waits_for_what_the_plc_is_at_work_on(cell, controller, monkeypatch):
    held_up(cell, controller)
    cell.plc.clock.sleep(11.0)
    later = cell.connect()
    ownership, at_work = later._mailbox.commands.ownership, [1, 2, 3]
    take = ownership.take

    def take_when_free():
        if at_work:
            raise RejectedError(f"busy {at_work.pop()}", code=ErrorClass.BUSY)
        take()

    monkeypatch.setattr(ownership, "take", take_when_free)
    recover(later)
    assert cell.open_requests() == []
    assert at_work == []


def test_a_runner_moves_and_jogs_the_group(controller):
    group = controller.groups[0]
    here = group.pose()
    box = WorkBox.around(here, xy_mm=10, below_mm=10, above_mm=10)
    runner = Runner(controller, group, Nobody(), RunSettings(box))
    assert runner.jog("x+1.5 z-0.5").x_mm == pytest.approx(here.x_mm + 1.5)
    motion = group.move_to(here, MotionProfile(Path.JOINT), box=box)
    motion.wait(timeout_s=5)
    assert group.pose().coordinates() == pytest.approx(here.coordinates())


def test_a_softmotion_url_leads_to_a_mailbox(cell, monkeypatch):
    monkeypatch.setattr(softmotion, "open_mailbox_link", lambda *_args, **_options: cell.link)
    with connect("softmotion+modbus-tcp://192.0.2.1") as controller:
        assert isinstance(controller, SoftMotionController)
        assert controller.identity == cell.link.identity
    assert cell.link.closed


def test_a_mailbox_that_does_not_run_is_not_reached(cell, monkeypatch):
    monkeypatch.setattr(softmotion, "open_mailbox_link", lambda *_args, **_options: cell.link)
    cell.plc.frozen = True
    with pytest.raises(ConnectError):
        connect("softmotion+modbus-tcp://192.0.2.1")
    assert cell.link.closed
