"""A backup is complete, and a restore either completes or reports how far it came."""

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction

from robolink.backup import (
    compare,
    keep_first_backup,
    load,
    plan_restore,
    read_tools,
    restore,
    take_backup,
)
from robolink.errors import (
    ConfigError,
    NotReadyError,
    OutcomeUnknownError,
    ToolChangedError,
)
from robolink.journal import memory_journal, open_journal
from robolink.model import ToolOffset

pytestmark = pytest.mark.simulator_only

A, B, C = ToolOffset(12, -3.5, -20, 90), ToolOffset(0, 0, -50.125), ToolOffset(1, 2, 3, -45)


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=2)
    tools = simulator.machine.tools
    for tool, offset in ((1, A), (7, B), (15, C)):
        tools.set(tool, offset)
    tools.select(7)
    return simulator


def disorder(simulator):
    """Change, clear, add and select tools without going through robolink."""
    tools = simulator.machine.tools
    tools.set(1, ToolOffset(99))
    tools.clear(15)
    tools.set(3, C)
    tools.select(1)


@pytest.mark.remote_ethernet
def test_a_backup_holds_every_tool_and_which_controller_it_was(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        backup = take_backup(controller)
    assert backup.state.selected == 7
    assert backup.state.tools == dict.fromkeys(range(1, 16)) | {1: A, 7: B, 15: C}
    assert backup.controller == cell.url
    assert backup.facts.robot_serials == (simulator.machine.serial,)
    assert backup.facts.firmware


def test_a_controller_without_any_tool_has_fifteen_undefined_ones(serve):
    simulator = EpsonSimulator(seed=2)
    simulator.machine.tools.select(0)
    simulator.machine.tools.clear(1)
    with serve(simulator) as cell, cell.connect() as controller:
        assert take_backup(controller).state.tools == dict.fromkeys(range(1, 16))


def test_taking_one_writes_nothing(serve, simulator):
    written = simulator.machine.flash_writes
    with serve(simulator) as cell, cell.connect() as controller:
        take_backup(controller)
    assert simulator.machine.flash_writes == written


@pytest.mark.on_every_link
def test_a_restore_brings_everything_back_with_one_write_a_tool(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        backup = take_backup(controller)
        disorder(simulator)
        written = simulator.machine.flash_writes
        plan = plan_restore(backup, read_tools(controller), selected=True)
        receipts = restore(controller.tools, plan)
        assert compare(backup.state, read_tools(controller)).equal
    assert [receipt.tool for receipt in receipts] == [1, 15, 3]
    assert simulator.machine.flash_writes == written + 3


def test_without_being_asked_the_tool_in_force_is_left_alone(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        backup = take_backup(controller)
        disorder(simulator)
        told: list[str] = []
        plan = plan_restore(backup, read_tools(controller))
        restore(controller.tools, plan, tell=told.append)
        assert controller.tools.selected() == 1
    assert len(told) == 3


def test_a_tool_that_someone_changed_meanwhile_is_not_written(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        backup = take_backup(controller)
        disorder(simulator)
        plan = plan_restore(backup, read_tools(controller))
        simulator.machine.tools.set(15, ToolOffset(5))
        with pytest.raises(ToolChangedError) as caught:
            restore(controller.tools, plan)
        assert controller.tools.read(15) == ToolOffset(5)
        assert controller.tools.read(1).matches(A, 0.0005)
    assert "Restored before that: 1. Not restored: 15, 3." in caught.value.what


def test_an_answer_that_is_lost_says_which_tools_are_done(serve):
    fault = Fault(FaultAction.DISCONNECT_BEFORE, match="TLSet 15,")
    simulator = EpsonSimulator(seed=2, faults=[fault])
    simulator.machine.tools.set(15, C)
    with serve(simulator) as cell, cell.connect() as controller:
        backup = take_backup(controller)
        simulator.machine.tools.set(1, ToolOffset(99))
        simulator.machine.tools.set(15, ToolOffset(99))
        plan = plan_restore(backup, read_tools(controller))
        with pytest.raises(OutcomeUnknownError) as caught:
            restore(controller.tools, plan)
    assert "Restored before that: 1. Not restored: 15." in caught.value.what


def test_a_running_program_lets_no_backup_be_taken(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        simulator.panel.start_production()
        with pytest.raises(NotReadyError):
            take_backup(controller)


@pytest.fixture
def kept(serve, simulator):
    """Connect with a record that outlives the process, as for a real controller."""
    with serve(simulator) as cell:
        yield lambda: cell.connect(outcomes=open_journal().log(cell.url))


def test_the_first_write_is_preceded_by_a_backup_and_the_second_is_not(kept):
    with kept() as controller:
        path = keep_first_backup(controller)
        assert path is not None
        before = read_tools(controller)
        controller.tools.write(15, C, expected=before.tools[15])
        assert keep_first_backup(controller) is None
    assert load(path).state == before


def test_without_a_place_for_it_there_is_no_backup_and_an_error(kept, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    with kept() as controller:
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "file"))
        with pytest.raises(ConfigError, match="cannot back up"):
            keep_first_backup(controller)


def test_a_simulator_that_dies_with_the_process_needs_none(serve, simulator, tmp_path):
    with serve(simulator) as cell:
        outcomes = memory_journal(cell.url).log(cell.url)
        with cell.connect(outcomes=outcomes) as controller:
            assert keep_first_backup(controller) is None
    assert not (tmp_path / "state").exists()
