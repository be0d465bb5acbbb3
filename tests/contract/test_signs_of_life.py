"""An idle open block stays alive: another client is told and cannot take its lock.

Two computers share a journal, or only the PLC (docs/decisions/0067). No real time passes: the test
advances it, on every link.
"""

from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.epson.device import EpsonSimulator

import robolink
from robolink.errors import (
    LeaseHeldError,
    LeaseLostError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportClosedError,
)
from robolink.journal import LEASE_S, LeaseHolder, open_journal
from robolink.model import ANY, EntryKind, Signature, ToolOffset, WorkBox
from robolink.runtime import replaced
from robolink.transaction import ToolChange, Wanted, recover
from tests.contract._quiet_time import QuietTime
from tests.contract._softmotion_cell import SLOW, above, served
from tests.contract.conftest import served as epson_served

OLD, NEW, OTHER = (ToolOffset(12.0, -3.5, z_mm) for z_mm in (-20.0, -20.5, -21.0))
QUIET_S = 30.0
ANN = LeaseHolder(os_user="ann", host="pc-1", pid=11, process_start="pids 1", boot="one")
BOB = replace(ANN, os_user="bob", host="pc-2", pid=22, boot="two")
DISPOSSESSED = {106, 107}


class Plc:
    """A PLC, two computers that command it, and their common time."""

    def __init__(self, cell, folder):
        self.cell = cell
        self.time = QuietTime(cell.clock)
        self.shared = open_journal(str(folder / "shared.db"))
        self.others = open_journal(str(folder / "others.db"))

    def connect(self, holder, journal=None):
        log = (journal or self.shared).log(
            self.cell.url,
            holder=holder,
            clock=self.time,
            signature=Signature(os_user=holder.os_user, host=holder.host, operator=holder.os_user),
        )
        return robolink.connect(self.cell.url, outcomes=log, clock=self.cell.clock)

    @property
    def held(self):
        """The Z in the slot, read by a separate connection."""
        return self.cell.simulator.plc.memory.slot(1).tool[2]

    @property
    def epoch(self):
        return self.cell.simulator.plc.memory.epoch


def made(backend, folder):
    with served(backend) as cell:
        plc = Plc(cell, folder)
        with replaced(plc.time):
            yield plc


@pytest.fixture(params=["sim", "modbus-tcp", pytest.param("can-multicast", marks=pytest.mark.soak)])
def plc(request, tmp_path):
    yield from made(request.param, tmp_path)


@pytest.fixture
def in_process(tmp_path):
    yield from made("sim", tmp_path)


def dispossessed(error):
    """Whether an act was refused because another client took over."""
    if isinstance(error, RejectedError):
        return error.code in DISPOSSESSED
    return isinstance(error, LeaseLostError)


def changed(controller, offset=NEW, before=OLD):
    return ToolChange(controller, [Wanted(1, offset, before)], verify=True)


def test_a_quiet_change_is_not_taken_back_by_a_second_pc(plc):
    with plc.connect(ANN) as first, changed(first) as change:
        change.write()
        plc.time.sleep(QUIET_S)
        with plc.connect(BOB) as second, pytest.raises(LeaseHeldError) as told:
            recover(second, confirm=lambda _: True)
        assert "ann (process 11 on pc-1) has locked" in told.value.what
        assert "change of tool 1" in told.value.what
        assert "Last response: while it was watched just now" in told.value.what
        assert plc.held == NEW.z_mm
        change.keep("parts were good")
    assert plc.held == NEW.z_mm
    assert plc.shared.open_markers() == ()
    assert plc.time.going_on == 0


@pytest.mark.parametrize("backend", ["sim", "tcp"])
def test_the_lease_of_an_epson_controller_is_renewed_while_its_login_is_held(backend, tmp_path):
    simulator = EpsonSimulator(seed=7)
    journal, time = open_journal(str(tmp_path / "shared.db")), QuietTime(ManualClock())
    with epson_served(backend, simulator) as cell, replaced(time):
        log, others = (
            journal.log(cell.url, holder=holder, clock=time)
            for holder in (ANN, replace(ANN, pid=12, process_start=""))
        )
        with cell.connect(outcomes=log) as first:
            before = first.tools.read(1)
            with changed(first, before=before) as change:
                change.write()
                sent = first.exchanges
                time.sleep(QUIET_S)
                assert first.exchanges == sent, "the controller was sent something"
                with pytest.raises(LeaseHeldError, match="Last response: 0 s ago"):
                    journal.log(
                        log.identity, holder=replace(ANN, pid=12, process_start=""), clock=time
                    ).look()
                change.keep("parts were good")
        assert others.at_work() == ""


def test_a_second_pc_that_shares_only_the_plc_is_refused_by_it(plc):
    with plc.connect(ANN) as first, changed(first) as change:
        change.write()
        plc.time.sleep(QUIET_S)
        with plc.connect(BOB, plc.others) as second, pytest.raises(LeaseHeldError) as told:
            second.tools.write(1, OTHER, expected=NEW)
        assert f"client {plc.cell.owner:08X}" in told.value.what
        assert plc.held == NEW.z_mm
        change.keep("parts were good")


def test_its_recover_of_what_it_left_itself_is_refused_too(in_process, tmp_path, monkeypatch):
    plc = in_process

    def at(holder):
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / holder.host))
        return plc.connect(holder, plc.others if holder is BOB else plc.shared)

    with at(BOB) as second:
        left = changed(second, OTHER)
        left.__enter__().write()
        left._signs_of_life.close()
        second._mailbox.wire.close()
    plc.time.sleep(QUIET_S)
    with at(ANN) as first, ToolChange(first, [Wanted(2, NEW, ANY)], verify=True) as change:
        change.write()
        plc.time.sleep(QUIET_S)
        with at(BOB) as second, pytest.raises(RobolinkError) as told:
            # A client that waits for a silent owner lets the others go on meanwhile.
            clock = type(second._mailbox.wire.clock)
            monkeypatch.setattr(clock, "sleep", lambda _clock, s: plc.time.sleep(s))
            recover(second, confirm=lambda _: True)
        assert "ann (process 11 on pc-1) has commanded the PLC" in str(told.value) or (
            f"client {plc.cell.owner:08X}" in str(told.value)
        )
        assert plc.held == OTHER.z_mm
        change.keep("parts were good")


@pytest.mark.parametrize(
    "plc",
    ["sim", "modbus-tcp", pytest.param("can-multicast", marks=pytest.mark.soak)],
    indirect=True,
)
def test_a_person_insists_and_the_old_holder_is_refused_from_then_on(plc):
    before = plc.epoch
    with plc.connect(ANN) as first:
        change = changed(first)
        with pytest.raises(LeaseLostError) as refused, change:
            change.write()
            plc.time.sleep(QUIET_S)
            owner = f"{plc.cell.owner:08X}"
            with plc.connect(BOB) as second:
                second.take_over("ann went home")
                assert plc.epoch == before + 2  # she took it over, then he did
                assert recover(second, confirm=lambda _: True).left == ()
            assert plc.held == OLD.z_mm
            change.keep("parts were good")
        assert "bob (process 22 on pc-2) took over" in refused.value.what
        for act in (
            lambda: first.tools.write(1, OTHER, expected=OLD),
            lambda: first.tools.write(2, OTHER, expected=ANY),
        ):
            with pytest.raises(RobolinkError) as told:
                act()
            # On a CAN bus both use one SDO channel, and the second has broken in on the first.
            broken = isinstance(told.value, TransportClosedError | RemoteProtocolError)
            assert (broken and "can" in plc.cell.url) or dispossessed(told.value)
    taken, insisted = plc.shared.entries(kinds=(EntryKind.LEASE,))
    assert insisted.verdict.startswith("bob (process 22 on pc-2) took over")
    assert "ann (process 11 on pc-1)" in insisted.verdict
    assert "ann went home" in insisted.verdict
    assert taken.details == {"taken_from": owner, "reason": "ann went home"}
    assert plc.held == OLD.z_mm
    assert plc.shared.open_markers() == ()


@pytest.mark.parametrize("end", ["left", "failed"])
def test_after_that_the_old_value_is_not_written_back_by_who_lost_it(in_process, end):
    plc = in_process
    with plc.connect(ANN) as first, pytest.raises(LeaseLostError, match=r"bob .* took over"):
        with changed(first) as change:
            change.write()
            with plc.connect(BOB) as second:
                second.take_over("ann went home")
                assert recover(second, keep=True).left == ()
            if end == "failed":
                raise ValueError("a part was bad")
    assert plc.held == NEW.z_mm


def test_after_that_the_mailbox_of_the_other_is_not_given_back(in_process):
    plc = in_process
    with plc.connect(ANN) as first:
        first.take()
        with plc.connect(BOB, plc.others) as second:
            second.take_over("ann went home")
            owner = plc.cell.owner
            with pytest.raises(LeaseLostError, match="another client has taken over the mailbox"):
                first._mailbox.commands.ownership.release()
            assert plc.cell.owner == owner


def test_after_that_no_movement_of_the_old_holder_begins(in_process):
    plc = in_process
    with plc.connect(ANN) as first:
        group = first.groups[0]
        first.take()
        with first.preserved("a look"):
            here = group.pose()
            with plc.connect(BOB, plc.others) as second:
                second.take_over("ann went home")
            started = plc.cell.movements_started
            with pytest.raises(RejectedError) as refused:
                group.move_to(above(here, 5), SLOW, box=WorkBox())
            assert refused.value.code in DISPOSSESSED
            assert plc.cell.movements_started == started


def test_a_movement_that_nobody_waits_on_makes_the_block_silent(in_process):
    plc = in_process
    with plc.connect(ANN) as first:
        log = plc.shared.log(plc.cell.url, holder=replace(ANN, process_start=""), clock=plc.time)
        with first.preserved("a look"):
            here = first.groups[0].pose()
            motion = first.groups[0].move_to(above(here, 20), SLOW, box=WorkBox())
            beaten = [*plc.cell.simulator.log][-1]
            assert "still working" in log.at_work()
            plc.time.sleep(LEASE_S + 1)
            assert [*plc.cell.simulator.log][-1] == beaten, "the PLC was sent something"
            assert log.at_work() == "", "the lease was renewed"
            with pytest.raises(RobolinkError):
                motion.wait(timeout_s=60)
            plc.time.sleep(2)
            assert "still working" in log.at_work()
