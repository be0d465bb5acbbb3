"""A run killed while it owned a PLC's mailbox: the next one names it, waits or is told."""

import signal
from dataclasses import replace

import pytest

import robolink
from robolink.errors import LeaseHeldError, StoppedError
from robolink.files.durable import state_folder
from robolink.journal import open_journal, this_process
from robolink.model import ANY, ToolOffset
from robolink.runtime import replaced
from robolink.timing import NS_PER_S
from robolink.transaction import ToolChange, Wanted, recover
from tests.contract._quiet_time import QuietTime
from tests.contract._softmotion_cell import served

OLD, NEW = ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.0, -3.5, -20.5)
HERE = replace(this_process(), os_user="ann")
ENDED = replace(HERE, pid=2**22 + 1, operator="Bea")
LIVES = replace(HERE, operator="Dan")
ELSEWHERE = replace(HERE, host="pc-2", boot="another", operator="Cid")


class Plc:
    """A PLC, and runs of robolink on this computer and on others."""

    def __init__(self, cell, folder):
        self.cell = cell
        self.time = QuietTime(cell.clock)
        self.journal = open_journal(str(folder / "journal.db"))
        self.told = []

    def connect(self, holder):
        log = self.journal.log(self.cell.url, holder=holder, clock=self.time)
        return robolink.connect(self.cell.url, outcomes=log, clock=self.time, tell=self.told.append)

    def killed(self, holder, act):
        """Start somebody's action and kill it in the middle."""
        run = self.connect(holder)
        act(run)
        run._mailbox.wire.close()

    @property
    def now_s(self):
        return self.time.now_ns() / NS_PER_S


@pytest.fixture(params=["sim", "modbus-tcp"])
def plc(request, tmp_path):
    with served(request.param) as cell:
        cell.simulator.durable = True
        made = Plc(cell, tmp_path)
        with replaced(made.time):
            yield made


@pytest.fixture
def in_process(tmp_path):
    with served("sim") as cell:
        made = Plc(cell, tmp_path)
        with replaced(made.time):
            yield made


@pytest.fixture
def on_a_port(tmp_path):
    """A served PLC on which others act while a client waits."""
    with served("modbus-tcp") as cell:
        made = Plc(cell, tmp_path)
        with replaced(made.time):
            yield made


def notes():
    folder = state_folder("clients")
    return [*folder.iterdir()] if folder.exists() else []


def test_a_run_of_this_computer_that_has_ended_is_named_and_waited_out(plc):
    change = []

    def changes(run):
        change.append(ToolChange(run, [Wanted(1, NEW, OLD)], verify=True).__enter__())
        change[0].write()
        change[0]._signs_of_life.close()  # with its process

    plc.killed(ENDED, changes)
    began_s = plc.now_s
    with plc.connect(HERE) as next_run:
        assert recover(next_run, confirm=lambda _: True).left == ()
        waited_s = plc.now_s - began_s
    assert 8 < waited_s < 13
    waits, free = plc.told
    assert waits.startswith("Bea (ann, process 4194305 on ")
    assert "ended without releasing it. Waiting until it is free, 12 s at most." in waits
    assert free == "The mailbox is free."
    assert plc.cell.simulator.plc.memory.slot(1).tool[2] == OLD.z_mm
    assert plc.cell.owner == 0


def test_who_insists_does_not_wait_for_a_run_that_has_ended(in_process):
    plc = in_process
    plc.killed(ENDED, lambda run: run.take())
    began_s = plc.now_s
    with plc.connect(HERE) as next_run:
        next_run.take_over("Bea's PC is off")
        assert plc.now_s - began_s < 2
    assert plc.told == []


def test_a_command_without_a_marker_leaves_its_name_too(in_process):
    plc = in_process
    plc.killed(ENDED, lambda run: run.take())
    with plc.connect(HERE) as next_run:
        next_run.take()
    assert plc.told[0].startswith("Bea (ann, process")


@pytest.mark.parametrize(
    ("holder", "advice"),
    [(ELSEWHERE, "If it ended, wait 10 s"), (LIVES, "Wait, end it, or")],
    ids=["cannot be seen from here", "lives"],
)
def test_where_nobody_is_known_to_have_ended_it_is_said_at_once_who_it_is(
    in_process, holder, advice
):
    plc = in_process
    plc.killed(holder, lambda run: run.take())
    owner, began_s = plc.cell.owner, plc.now_s
    with plc.connect(HERE) as next_run, pytest.raises(LeaseHeldError) as told:
        next_run.tools.write(1, NEW, expected=ANY)
    assert f"on {holder.host}) has commanded the PLC" in told.value.what
    assert f"(client {owner:08X})" in told.value.what
    assert advice in told.value.remedy
    assert plc.now_s - began_s < 1
    assert plc.told == []


def test_a_token_that_nobody_noted_is_called_another_program(in_process):
    plc = in_process
    plc.killed(HERE, lambda run: run.take())
    for note in notes():
        note.write_text("{ torn")
    with plc.connect(HERE) as next_run, pytest.raises(LeaseHeldError, match="Another program"):
        next_run.take()


def test_the_wait_ends_when_the_plc_does_not_give_it_away(on_a_port):
    plc = on_a_port
    plc.killed(ENDED, lambda run: run.take())
    heard = plc.cell.simulator.plc.program.ownership.heard
    plc.time.regularly(1.0, lambda: heard(plc.time.now_ns()), "somebody who uses its token")
    began_s = plc.now_s
    with plc.connect(HERE) as next_run, pytest.raises(LeaseHeldError, match="Bea"):
        next_run.take()
    assert 11 < plc.now_s - began_s < 15


def test_a_stop_ends_the_wait(on_a_port):
    plc = on_a_port
    plc.killed(ENDED, lambda run: run.take())
    with plc.connect(HERE) as next_run:
        plc.time.regularly(1.0, next_run.latch.close, "a stop")
        began_s = plc.now_s
        with pytest.raises(StoppedError):
            next_run.take()
        assert plc.now_s - began_s < 3


def test_ctrl_c_ends_the_wait_and_nothing_was_sent(on_a_port):
    plc = on_a_port
    plc.killed(ENDED, lambda run: run.take())
    presses = iter((signal.SIGINT,))

    def press():
        for key in presses:
            signal.raise_signal(key)

    plc.time.regularly(1.0, press, "a person")
    with plc.connect(HERE) as next_run:
        began_s = plc.now_s
        with pytest.raises(KeyboardInterrupt):
            next_run.tools.write(1, NEW, expected=ANY)
        assert plc.now_s - began_s < 3
    assert plc.cell.commands == []


def test_nothing_is_left_of_a_run_that_gave_the_mailbox_back_or_never_got_it(in_process):
    plc = in_process
    with plc.connect(HERE) as owner:
        owner.take()
        assert len(notes()) == 1
        with plc.connect(ELSEWHERE) as other, pytest.raises(LeaseHeldError):
            other.take()
        assert len(notes()) == 1
    assert notes() == []
