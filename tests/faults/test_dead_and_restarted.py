"""Far ends that fall silent, come back late, restart or forget the login.

Requests on their way are unconfirmed and never sent again; the next client finds the present state,
and reports it.
"""

import threading
import time

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.errors import (
    OutcomeUnknownError,
    RejectedError,
    RobolinkError,
    ToolChangedError,
    TransportClosedError,
    TransportError,
)
from robolink.model import Verdict
from robolink.transaction import Wanted, change_tools, changed_since, recover
from tests.contract._softmotion_cell import PlcCell, served
from tests.faults._bending_relay import BendingRelay

OLD, NEW = ToolOffset(12.5, -3.25, -20.0), ToolOffset(12.75, -3.0, -20.5)
WRITE = "TLSet 1, XY"
SLOT = 15
TIMEOUT_S = 2.0


@pytest.fixture
def controlled(serve_simulator):
    """A controller in process, in simulated time, and its link."""
    simulator = EpsonSimulator(seed=5)
    simulator.machine.tools.set(1, OLD)
    return simulator, serve_simulator(simulator).url


def requests(simulator, text):
    return [shown for _, way, shown in simulator.log if way == ">" and text in shown]


def through(url, relay):
    """Return ``url`` with the port of the relay."""
    head, _, tail = url.partition("127.0.0.1:")
    return f"{head}127.0.0.1:{relay.port}{tail.lstrip('0123456789')}"


def port_of(url):
    return int(url.partition("127.0.0.1:")[2].partition("?")[0].partition("/")[0])


@pytest.mark.fault("F11", "F12")
def test_f11_f12_a_write_that_is_held_back_is_unproved_and_arrives_at_most_once():
    simulator = EpsonSimulator(seed=5)
    simulator.machine.tools.set(1, OLD)
    with serve_tcp(simulator, clock=ScaledClock()) as host:
        with BendingRelay(port_of(host.url), hold_at=WRITE.encode()) as relay:
            url = through(host.url, relay)
            with robolink.connect(url, timeout_s=TIMEOUT_S) as controller:
                began = time.monotonic()
                with pytest.raises(OutcomeUnknownError, match="did not answer in time"):
                    controller.tools.write(1, NEW, expected=OLD)
                assert time.monotonic() - began < TIMEOUT_S + 3
                with pytest.raises(TransportClosedError):
                    controller.tools.write(1, NEW, expected=OLD)
                outcomes = controller.outcomes
            # Trying again sends a login, which is not answered, and nothing else.
            for _ in range(3):
                with pytest.raises(RobolinkError):
                    robolink.connect(url, timeout_s=0.1)
            assert relay.connections == 4
            assert requests(simulator, WRITE) == []
            relay.holding.clear()
            wait_for(lambda: requests(simulator, WRITE))
        with robolink.connect(host.url, outcomes=outcomes) as controller:
            (finding,) = recover(controller).settled
            assert finding.verdict is Verdict.DONE
    assert len(requests(simulator, WRITE)) == 1


@pytest.mark.fault("F11", "F12")
def test_f11_f12_so_is_a_command_block_over_modbus():
    simulator = SoftMotionSimulator(seed=7)
    with served("modbus-tcp", simulator) as cell:
        # The operation code of WRITE_TOOL, 5205, as sent.
        with BendingRelay(port_of(cell.url), hold_at=(5205).to_bytes(2, "big")) as relay:
            behind = PlcCell(through(cell.url, relay), simulator, cell.clock)
            behind.journal = cell.journal
            with behind.connect(timeout_s=TIMEOUT_S) as controller:
                with pytest.raises(OutcomeUnknownError):
                    controller.tools.write(SLOT, NEW, expected=None)
            for _ in range(3):
                with pytest.raises(RobolinkError):
                    behind.connect(timeout_s=0.1)
            assert cell.commands == []
            relay.holding.clear()
            wait_for(lambda: cell.commands)
        with cell.connect() as controller:
            recover(controller)
            assert controller.tools.read(SLOT) in (None, NEW)
        assert cell.commands == ["WRITE_TOOL"]


def wait_for(condition):
    """Wait until the work in another thread has got that far."""
    tick = threading.Event()
    for _ in range(500):
        if condition():
            return
        tick.wait(0.01)
    raise AssertionError("it never came")


STEPS = 6
"""More than the exchanges of a change: with no exchange left, it ends as without a fault."""


@pytest.mark.fault("F13")
@pytest.mark.parametrize("action", [FaultAction.DISCONNECT, FaultAction.DISCONNECT_BEFORE])
@pytest.mark.parametrize("step", range(STEPS))
def test_f13_a_controller_that_starts_anew_in_a_change_is_sent_nothing_again(
    controlled, action, step
):
    simulator, url = controlled
    with robolink.connect(url, timeout_s=TIMEOUT_S) as controller:
        simulator.faults.add(Fault(action, on_exchange=step))
        said = None
        try:
            change_tools(controller, [Wanted(1, NEW, OLD)])
        except RobolinkError as error:
            said = error
        sent = len(requests(simulator, WRITE))
        assert sent <= 1
        simulator.restart()
        with pytest.raises(RobolinkError):
            controller.tools.write(1, NEW, expected=OLD)
        assert len(requests(simulator, WRITE)) == sent
    with robolink.connect(url) as controller:
        recover(controller)
        held = simulator.machine.tools.get(1)
        assert held in (OLD, NEW)
        assert said is not None or held == NEW
        assert controller.outcomes.open_markers() == ()
    # recover may write the old value back once.
    assert len(requests(simulator, WRITE)) <= sent + 1


@pytest.mark.fault("F14")
def test_f14_an_old_value_after_a_start_is_told_and_not_written_over(controlled):
    simulator, url = controlled
    with robolink.connect(url) as controller:
        change_tools(controller, [Wanted(1, NEW, OLD)])
    simulator.restart()
    simulator.machine.tools.set(1, OLD)
    sent = len(requests(simulator, WRITE))
    with robolink.connect(url) as controller:
        found = changed_since(controller, 1, controller.tools.read(1))
        assert found is not None
        assert (found.recorded, found.now) == (NEW, OLD)
        with pytest.raises(ToolChangedError):
            change_tools(controller, [Wanted(1, ToolOffset(1, 1, 1), NEW)])
        assert simulator.machine.tools.get(1) == OLD
    assert len(requests(simulator, WRITE)) == sent


@pytest.mark.fault("F15")
def test_f15_a_login_that_is_lost_is_named_and_not_renewed(controlled):
    simulator, url = controlled
    with robolink.connect(url) as controller:
        before = controller.tools.read(1)
        simulator._slot.free()
        for _ in range(3):
            with pytest.raises((RejectedError, TransportError)) as lost:
                controller.tools.write(1, NEW, expected=before)
            assert "log in" in lost.value.remedy
        assert len(requests(simulator, "$Login")) == 1
        assert requests(simulator, WRITE) == []
    with robolink.connect(url) as controller:
        assert controller.tools.read(1) == before
    assert len(requests(simulator, "$Login")) == 2
