"""Idle open blocks on a journal, and a server that can no longer be reached (F78)."""

import socket
from collections.abc import Iterator
from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ManualClock, ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.controllers import SimpleController, SimpleMachine
from robolink.errors import JournalError, LeaseHeldError, LeaseLostError, RobolinkError
from robolink.journal import LEASE_S, ChainVerification, LeaseHolder
from robolink.model import ToolOffset
from robolink.runtime import replaced
from robolink.timing import NS_PER_S
from robolink.transaction import ToolChange, Wanted, change_tools, recover
from tests.contract._quiet_time import QuietTime
from tests.faults._firewall import Firewall

# An idle open block keeps its lease, in a file and on PostgreSQL.

NEW = ToolOffset(1.0, 2.0, -30.0)
ANN = LeaseHolder(os_user="ann", host="pc-1", pid=11, boot="one")
BOB = replace(ANN, os_user="bob", host="pc-2", pid=22, boot="two")


@pytest.fixture
def time():
    time = QuietTime(ManualClock())
    with replaced(time):
        yield time


@pytest.fixture
def connect(location, open_anew, time):
    """Connect from another computer to a controller that both reach."""
    machine = SimpleMachine()

    def connected(holder):
        log = open_anew(location).log("acme+usb://cell", holder=holder, clock=time)
        return SimpleController(machine, outcomes=log)

    return connected


def test_who_watches_it_from_another_computer_sees_it_live(connect, time):
    first = connect(ANN)
    with ToolChange(first, [Wanted(1, NEW, first.tools.read(1))], verify=True) as change:
        change.write()
        time.sleep(3 * LEASE_S)
        with pytest.raises(LeaseHeldError, match=r"ann \(process 11 on pc-1\)"):
            recover(connect(BOB), confirm=lambda _: True)
        change.keep("parts were good")
    assert first.tools.read(1) == NEW


def test_who_insists_has_it_and_the_other_keeps_nothing(connect, time):
    first, second = connect(ANN), connect(BOB)
    with pytest.raises(LeaseLostError, match=r"bob \(process 22 on pc-2\) took over"):
        with ToolChange(first, [Wanted(1, NEW, first.tools.read(1))], verify=True) as change:
            change.write()
            time.sleep(3 * LEASE_S)
            second.take_over("ann went home")
            change.keep("parts were good")
    assert len(second.outcomes.open_markers()) == 1


# A journal on a server that can no longer be reached: row F78 of the catalogue.

NEW_OFFSET = ToolOffset(12.25, -3.5, -20.0)
OLD = ToolOffset(12.0, -3.5, -20.0)


@pytest.fixture
def firewall(server) -> Iterator[Firewall]:
    firewall = Firewall(server.port)
    yield firewall
    firewall.close()


@pytest.fixture
def epson() -> Iterator[EpsonSimulator]:
    simulator = EpsonSimulator(seed=2)
    simulator.machine.tools.set(1, OLD)
    with serve_tcp(simulator, clock=ScaledClock(40.0)):
        yield simulator


def writes(simulator: EpsonSimulator) -> int:
    return sum('"TLSet 1, XY' in text for _, way, text in simulator.log if way == ">")


@pytest.mark.fault("F78")
@pytest.mark.parametrize(
    "when",
    [
        pytest.param("before the change", marks=pytest.mark.soak),
        "at the write",
        pytest.param("once it is written", marks=pytest.mark.soak),
    ],
)
def test_f78_without_the_shared_journal_nothing_new_begins_and_what_runs_ends_safely(
    server, firewall, epson, open_anew, when
):
    place = server.empty_place().replace(str(server.port), str(firewall.port))
    journal = open_anew(place)
    at = {"at the write": "TLSet 1, XY", "once it is written": "Print TLSet(1)"}.get(when, "")

    def cut(_number: int, text: str) -> None:
        if at and at in text and writes(epson) == 1:
            firewall.cut()

    mine = journal.log(epson.url, clock=ManualClock(0))
    with robolink.connect(epson.url, outcomes=mine) as controller:
        controller.tools.read(1)
        controller.require_settled("a change")
        epson.on_request = cut
        if not at:
            firewall.cut()
        with pytest.raises(RobolinkError) as ended:
            change_tools(controller, [Wanted(1, NEW_OFFSET, OLD)])
        epson.on_request = None
        assert "cannot be reached" in str(ended.value) or "record" in str(ended.value), ended.value
        written = writes(epson)
        assert written == (0 if not at else written)
        # Nothing else begins.
        with pytest.raises(JournalError, match="cannot be reached"):
            controller.tools.write(2, NEW_OFFSET, expected=None)
        assert writes(epson) == written <= 2
        assert epson.machine.tools.get(2) is None
    firewall.mend()
    # The lease could not be released: the next client gets it when it expires.
    later = journal.log(epson.url, clock=ManualClock(round((LEASE_S + 1) * NS_PER_S)))
    with robolink.connect(epson.url, outcomes=later) as controller:
        recover(controller)
        controller.require_settled("a movement")
        assert controller.tools.read(1) in (OLD, NEW_OFFSET)
        assert writes(epson) <= 2
        controller.tools.write(2, NEW_OFFSET, expected=None)
    verified = journal.verify()
    assert isinstance(verified, ChainVerification)
    assert verified.problems == ()


@pytest.mark.fault("F78")
def test_f78_a_server_that_the_network_loses_is_missed_within_seconds(server, open_anew):
    """The kernel's time-out is set; without it a transaction would wait for two hours."""
    journal = open_anew(server.empty_place())
    with journal._store.read() as tables:
        raw = tables.connection.driver
        with socket.socket(fileno=raw.fileno()) as line:
            wanted = {
                socket.TCP_USER_TIMEOUT: 3000,
                socket.TCP_KEEPIDLE: 1,
                socket.TCP_KEEPINTVL: 1,
                socket.TCP_KEEPCNT: 2,
            }
            found = {name: line.getsockopt(socket.IPPROTO_TCP, name) for name in wanted}
            line.detach()
    assert found == wanted
