"""A PLC behind the interfaces that procedures and tool changes use, and behind its URL."""

import pytest

from robolink.controllers import SoftMotionController, connect
from robolink.controllers.softmotion import controller as softmotion
from robolink.errors import (
    ConfigError,
    ConnectError,
    LeaseHeldError,
    OutcomeUnknownError,
    RejectedError,
)
from robolink.model import MotionProfile, Path, ToolOffset, Verdict, WorkBox
from robolink.protocols.mailbox import ErrorClass, Opcode
from robolink.runner import Question, Runner, RunSettings
from robolink.transaction import ToolChange, Wanted, change_tools, look, recover

OLD = ToolOffset(1.5, -2.0, 40.0, 10.0)
NEW = ToolOffset(1.7, -2.1, 40.3, 20.0)


class Nobody:
    """An operator who is never asked."""

    def tell(self, text: str) -> None:
        """Hear nothing."""

    def ask(self, question: str, kind: Question) -> None:
        """Be asked nothing."""
        raise AssertionError(question)

    def poll(self, wait_s: float) -> str | None:
        """Say nothing."""
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
    """Let a write of tool 3 be given up; what is returned lets it arrive."""
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
    assert len(cell.link.sent) == 2  # it asks twice, and does not stand in that client's way


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


def test_a_dialogue_with_a_plc_is_not_recorded_by_half():
    with pytest.raises(ConfigError, match="cannot be recorded"):
        connect("softmotion+modbus-tcp://192.0.2.1", trace=lambda *_passage: None)
