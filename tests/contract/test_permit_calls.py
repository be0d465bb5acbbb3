"""A PLC program starts a calibration through the profile tools: permit in, xToolChanged out."""

import pytest
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.options import MailboxOptions

from robolink import checkpoints
from robolink.checkpoints import Checkpoint
from robolink.errors import CalibrationError, ConfigError
from robolink.model import EntryKind
from robolink.serving import CallbackLimits, PermitCall, PermitPlan, free_machine
from robolink.transaction import recover
from tests.contract._permit_machine import PermitMachine
from tests.contract._softmotion_cell import BACKENDS, OWNER_SILENCE_S, served

LIMITS = CallbackLimits(tolerance_mm=0.1, sigma_mm=0.01)
PLAN = PermitPlan(1, look_s=0.02, patience_s=5.0)


def tools_only():
    return SoftMotionSimulator(seed=7, options=PlcOptions(mailbox=MailboxOptions(profile="tools")))


def call(cell, machine):
    with cell.connect() as controller:
        kept = answered(controller, machine)
    machine.look()
    return kept


def answered(controller, machine):
    """Answer the call; the machine runs a step at each poll."""

    def ended():
        machine.look()
        return machine.state == "gave up"

    return PermitCall(controller, PLAN, LIMITS, ended=ended).answer()


@pytest.fixture
def cell():
    with served("sim", tools_only()) as made:
        yield made


def kinds(cell):
    return [entry.kind for entry in cell.journal.entries(newest_first=False)]


def refused(cell, machine, code):
    """Check that the old value is stored and the machine may go on."""
    old = machine.stored
    with pytest.raises(CalibrationError) as caught:
        call(cell, machine)
    assert caught.value.code == code
    assert machine.stored == pytest.approx(old, abs=1e-9)
    machine.look()
    assert not machine.panel.tool_changed
    assert not machine.panel.owned
    assert cell.open_requests == []
    (entry,) = cell.journal.entries(kinds=(EntryKind.REFUSED,))
    assert entry.details["code"] == code


@pytest.mark.parametrize(
    "backend",
    [
        backend
        if backend in ("sim", "modbus-tcp")
        else pytest.param(backend, marks=pytest.mark.soak)
        for backend in BACKENDS
    ],
)
def test_a_needle_is_measured_written_proved_and_the_machine_goes_on(backend):
    with served(backend, tools_only()) as cell:
        machine = PermitMachine(cell.simulator)
        assert machine.error_mm > 0.2
        kept = call(cell, machine)
        assert kept is not None
        assert machine.stored == pytest.approx((kept.x_mm, kept.y_mm), abs=1e-6)
        assert machine.error_mm < 0.02
        assert machine.state == "produces"
        assert cell.open_requests == []
        # Besides the ownership commands: one write of the slot, and a reading of the selected tool.
        assert cell.commands == ["WRITE_TOOL", "READ_TOOL"]
        assert cell.movements_started == 0
        (done,) = cell.journal.entries(kinds=(EntryKind.DONE,))
        touches = done.details["flange"]
        assert isinstance(touches, list)
        assert len(touches) == 5
        assert done.details["called_back"] is True


@pytest.mark.soak
def test_a_touch_that_the_contact_did_not_see_never_comes(cell):
    """Another touch is not counted in its place: the machine gives up, and so does robolink."""
    machine = PermitMachine(cell.simulator)
    machine.miss = {2}
    refused(cell, machine, "no_touch")
    assert machine.state == "gave up"
    assert EntryKind.INTENT not in kinds(cell)


@pytest.mark.soak
def test_touches_that_scatter_give_no_value(cell):
    machine = PermitMachine(cell.simulator, noise_mm=0.2)
    with pytest.raises(CalibrationError):
        call(cell, machine)
    assert "WRITE_TOOL" not in cell.commands


def test_a_pin_that_was_bumped_before_the_proof_puts_the_old_value_back(cell):
    machine = PermitMachine(cell.simulator)
    machine.bump_mm = 0.15
    refused(cell, machine, "point_moved")
    assert machine.state == "produces"
    assert cell.commands.count("WRITE_TOOL") == 2


def test_a_permit_that_was_there_before_is_no_touch(cell):
    """A machine in its service state starts no calibration."""
    looks = 0

    def ended():
        nonlocal looks
        looks += 1
        return looks > 5

    cell.simulator.panel.give_permit()
    with cell.connect() as controller:
        assert PermitCall(controller, PLAN, LIMITS, ended=ended).answer() is None
    assert kinds(cell) == []


def test_without_the_permit_to_put_it_back_the_machine_stays_blocked_until_recover(cell):
    """The permit ends during the turn test for good: the slot holds an untested value."""
    machine = PermitMachine(cell.simulator)
    old = machine.stored
    machine.leaves = True
    with pytest.raises(CalibrationError):
        call(cell, machine)
    assert machine.stored != pytest.approx(old, abs=1e-3)
    assert machine.panel.tool_changed
    assert machine.state == "blocked"
    machine.restart()
    machine.look()
    assert machine.panel.tool_changed  # retained
    assert machine.state == "blocked"
    cell.clock.advance(OWNER_SILENCE_S)
    machine.panel.give_permit()
    with cell.connect() as controller:
        recover(controller)
        machine.look()
    assert machine.stored == pytest.approx(old, abs=1e-9)
    machine.look()
    assert machine.state == "produces"


class Gone(BaseException):
    """The PC is switched off at this moment."""


@pytest.mark.parametrize("step", [5, pytest.param(1, marks=pytest.mark.soak)])
def test_the_pc_goes_at_any_commit_and_the_machine_waits_for_a_settled_tool(step):
    """The value is old or tested when the machine goes on; else it is blocked until recover."""
    ends = set()
    for commit in range(0, 40, step):
        with served("sim", tools_only()) as cell:
            machine = PermitMachine(cell.simulator)
            old, at = machine.stored, -1

            controller = cell.connect()

            def observer(point, _what, commit=commit, controller=controller):
                nonlocal at
                at += point is Checkpoint.COMMIT
                if at >= commit:
                    controller._close_link()
                    raise Gone

            try:
                with checkpoints.observed(observer):
                    answered(controller, machine)
            except Gone:
                controller.outcomes.close()
            else:
                controller.close()
                break
            for _ in range(60):
                machine.look()
            changed = machine.stored != pytest.approx(old, abs=1e-9)
            if changed:
                assert machine.panel.tool_changed
                assert machine.state != "produces"
            cell.clock.advance(OWNER_SILENCE_S)
            machine.panel.give_permit()
            with cell.connect() as again:
                again.outcomes.take_over("the PC was switched off")
                recover(again)
            with cell.connect() as again:
                free_machine(again)
                machine.look()
            machine.look()
            assert cell.open_requests == []
            assert machine.state in ("produces", "gave up")
            settled = machine.stored != pytest.approx(old, abs=1e-9)
            ends.add(settled)
            assert not settled or machine.error_mm < 0.02
    else:
        pytest.fail("it never ends")
    assert False in ends


@pytest.mark.parametrize(
    "plan", [{"touches": 3}, {"proofs": 1}, {"method": "two-pose"}], ids=["few", "one", "two-pose"]
)
def test_a_plan_that_proves_nothing_is_refused(plan):
    with pytest.raises(ConfigError):
        PermitPlan(1, **plan)
