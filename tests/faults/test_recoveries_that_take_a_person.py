"""Recoveries of a value that is neither old nor new, and of a calibration that was cut short.

Rows F59 and F60 of the catalogue.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction, PlcFault, PlcFaultAction
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.errors import OutcomeUnknownError
from robolink.model import EntryKind, MotionProfile, ToolOffset, Verdict, WorkBox
from robolink.protocols.mailbox import to_frame
from robolink.transaction import recover
from tests.contract._softmotion_cell import served
from tests.faults import _killed_calibrations as calibrations
from tests.faults._epson_recipe_cell import EpsonRecipeCell
from tests.faults._kills import kill
from tests.faults._nozzle_cell import MOVE
from tests.faults._recipe_instants import Instants

NEW = ToolOffset(12.25, -3.5, -20.0)
THIRD = ToolOffset(15.5, 1.25, -21.0)


@dataclass
class Lossy:
    """A controller that loses the answer to the first write of tool 1."""

    url: str
    put_third: Callable[[], None]
    writes: Callable[[], int]
    moves: Callable[[], int]


@contextmanager
def epson() -> Iterator[Lossy]:
    faults = [Fault(FaultAction.DROP_REPLY, match="TLSet 1, XY")]
    simulator = EpsonSimulator(seed=2, faults=faults)
    machine = simulator.machine
    machine.switch_motors(True)
    with serve_tcp(simulator) as host:
        yield Lossy(
            host.url,
            lambda: machine.tools.set(1, THIRD),
            lambda: sum('"TLSet 1, XY' in text for _, way, text in simulator.log if way == ">"),
            lambda: machine.arm.moves_started,
        )


@contextmanager
def mailbox() -> Iterator[Lossy]:
    with served("modbus-tcp") as cell:
        cell.simulator.faults.add(PlcFault(PlcFaultAction.DISCONNECT, match="write_command WRITE"))
        memory = cell.simulator.plc.memory
        frame = to_frame(THIRD.components(), unit_um=1000.0)

        def put_third() -> None:
            cell.clock.advance(0.05)  # by then the program has read the command
            with cell.simulator.acting():
                memory.define(1, frame, "by hand")

        yield Lossy(
            cell.url,
            put_third,
            lambda: cell.commands.count("WRITE_TOOL"),
            lambda: cell.movements_started,
        )


@pytest.mark.fault("F59")
@pytest.mark.parametrize("kind", [epson, mailbox])
def test_f59_a_third_value_is_a_conflict_that_blocks_motion_until_a_person_decides(kind):
    with kind() as lossy:
        with robolink.connect(lossy.url, timeout_s=2.0) as controller:
            before = controller.tools.read(1)
            with pytest.raises(OutcomeUnknownError):
                controller.tools.write(1, NEW, expected=before)
        lossy.put_third()
        with robolink.connect(lossy.url) as controller:
            for _ in range(2):  # however often it is run
                (finding,) = recover(controller).left
                assert finding.verdict is Verdict.CONFLICT
                group = controller.groups[0]
                with pytest.raises(OutcomeUnknownError, match="did not finish"):
                    group.move_to(group.pose(), MotionProfile(), box=WorkBox())
            assert controller.tools.same(controller.tools.read(1), THIRD)
            assert (lossy.writes(), lossy.moves()) == (1, 0)
            (settled,) = recover(controller, confirm=lambda _finding: True).settled
            assert settled.verdict is Verdict.CONFLICT
            controller.require_settled("a movement")
            assert controller.tools.same(controller.tools.read(1), THIRD)
            recorded = [entry.kind for entry in controller.outcomes.recorded()]
            assert EntryKind.DONE not in recorded
        assert lossy.writes() == 1


@pytest.mark.soak
@pytest.mark.fault("F60")
def test_f60_a_calibration_that_was_cut_short_begins_again_at_its_first_step():
    whole = Instants()
    with calibrations.begun() as cell:
        assert cell.run(*calibrations.words(cell), instants=whole).code == 0
        touches = touches_of(cell)
    moved = [at for at in whole.passed if at.kind == "answer" and MOVE.match(at.what)]
    with calibrations.begun() as cell:
        words = calibrations.words(cell)
        kill(
            lambda life: cell.run(*words, instants=life),
            moved[4],
            lambda: check_begins_again(cell, touches),
        )


def check_begins_again(cell: EpsonRecipeCell, touches: list[int]) -> None:
    cell.come_to_rest()
    assert cell.changed() == set()
    asked = cell.moves_asked()
    assert cell.run(*calibrations.words(cell)).code == 6  # the unconfirmed movement comes first
    recovered = cell.run("recover", "--yes")
    assert recovered.code == 0, recovered.err
    assert cell.moves_asked() == asked == 5
    again = cell.run(*calibrations.words(cell))
    assert again.code == 0, again.err
    assert touches_of(cell) == touches


def touches_of(cell: EpsonRecipeCell) -> list[int]:
    """Return the number of poses of each recorded measurement."""
    measured = cell.journal.entries(kinds=(EntryKind.CALIBRATION,))
    return [len(entry.details["poses"]) for entry in measured]  # type: ignore[arg-type]
