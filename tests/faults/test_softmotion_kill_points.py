"""SIGKILL at each exchange and commit of a tool change on a PLC over Modbus TCP.

As ``test_transaction_kill_points`` does it on an EPSON controller. By default every commit and
every command block is a kill point; ``ROBOLINK_ALL_KILL_POINTS=1`` adds all reads. ``pytest
-s`` shows how many.
"""

import pytest

from tests.faults._change_cell import Step, WireStep
from tests.faults._change_process import NEW, OLD
from tests.faults._kill_points import (
    NOTHING_LEFT,
    check_killed_change,
    check_recovered,
    chosen,
)
from tests.faults._softmotion_change_cell import plc_change_cell
from tests.faults._steps import MOMENTS

pytestmark = pytest.mark.timeout(3600)


def written_by(step: Step) -> bool:
    """Whether a step is a write of a slot whose answer is lost."""
    return (
        isinstance(step, WireStep)
        and step.moment == MOMENTS[1]
        and step.request.startswith("write_command WRITE_TOOL")
    )


@pytest.mark.parametrize("program", [pytest.param("one tool", marks=pytest.mark.soak), "two tools"])
@pytest.mark.fault("F57", "F58")
def test_f57_f58_a_change_on_a_plc_killed_at_each_step_is_recovered_as_a_whole(tmp_path, program):
    with plc_change_cell(tmp_path / "whole") as cell:
        all_steps = cell.steps_of(program)
        right = {tool: NEW[tool] if tool in cell.writes() else OLD[tool] for tool in OLD}
        assert cell.tools == right
        assert NOTHING_LEFT in cell.recover()
    steps = chosen(cell, all_steps)
    for number, step in enumerate(steps):
        with plc_change_cell(tmp_path / str(number)) as cell:
            try:
                check_killed_change(cell, program, step)
            except AssertionError as error:
                error.add_note(f"killed at {step}")
                raise
    print(f"PLC, {program}: {len(steps)} kill points of {len(all_steps)}")  # noqa: T201 - for pytest -s


@pytest.mark.fault("F80")
def test_f80_a_recovery_on_a_plc_killed_at_each_step_may_be_run_again(tmp_path):
    program = "two tools"
    with plc_change_cell(tmp_path / "change") as cell:
        half = next(step for step in cell.steps_of(program) if written_by(step))
    with plc_change_cell(tmp_path / "whole") as cell:
        cell.kill(program, half)
        written = cell.writes()
        all_steps = cell.steps_of("recover")
        check_recovered(cell, program, written)
        assert cell.tools == OLD
    steps = chosen(cell, all_steps, every=4)
    for number, step in enumerate(steps):
        with plc_change_cell(tmp_path / str(number)) as cell:
            cell.kill(program, half)
            written = cell.writes()
            try:
                cell.kill("recover", step)
                cell.check_what_was_acknowledged_is_there()
                cell.recover()
                assert NOTHING_LEFT in cell.recover()
                check_recovered(cell, program, written)
            except AssertionError as error:
                error.add_note(f"recovery killed at {step}")
                raise
    print(f"PLC, recover: {len(steps)} kill points of {len(all_steps)}")  # noqa: T201 - for pytest -s
