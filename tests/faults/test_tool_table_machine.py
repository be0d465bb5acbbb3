"""A tool table behaves like a dictionary in any order of calls, faults and foreign writes.

Hypothesis draws the order: read, write, clear, select, change two tools, undo, another writer, a
lost answer, recovery, a new session, a restart of the controller. After each of them the controller
holds, past the wire, the dictionary's values.
"""

from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from robolink.controller_outcome import Effect, outcome_after
from robolink.errors import (
    ConfigError,
    OutcomeUnknownError,
    RobolinkError,
    SelectedToolError,
    ToolChangedError,
    UndefinedToolError,
)
from robolink.model import ToolOffset
from robolink.transaction import Wanted, change_tools, plan_undo, recover, undo
from tests.faults._tool_tables import TOOLS, EpsonTable, PlcTable

_STEPS_MM = st.sampled_from((-20.0, -3.5, 0.0, 0.125, 12.0, 12.5))
OFFSETS = st.builds(ToolOffset, _STEPS_MM, _STEPS_MM, _STEPS_MM)
NUMBERS = st.sampled_from(TOOLS)


class ToolTableMachine(RuleBasedStateMachine):
    """Calls of the API, and the dictionary that they are compared with."""

    kind: ClassVar[type[EpsonTable] | type[PlcTable]]

    def __init__(self) -> None:
        super().__init__()
        self.table = self.kind()
        self.controller = self.table.connect()
        self.held = self.table.held()
        self.selected = self.table.selected()
        self.unsettled = False

    def teardown(self) -> None:
        self.controller.close()
        self.table.close()

    @invariant()
    def the_controller_holds_what_the_dictionary_holds(self) -> None:
        assert self.table.held() == self.held
        assert self.table.selected() == self.selected

    @invariant()
    def what_is_unsettled_is_on_record(self) -> None:
        assert bool(self.table.journal.open_markers()) is self.unsettled

    @rule(tool=NUMBERS)
    def read(self, tool: int) -> None:
        assert self.controller.tools.read(tool) == self.held[tool]
        assert self.controller.tools.selected() == self.selected

    @precondition(lambda self: not self.unsettled)
    @rule(tool=NUMBERS, offset=OFFSETS)
    def write(self, tool: int, offset: ToolOffset) -> None:
        before = self.held[tool]
        receipt = self.controller.tools.write(tool, offset, expected=before)
        assert (receipt.before, receipt.skipped) == (before, before == offset)
        self.held[tool] = offset

    @precondition(lambda self: not self.unsettled)
    @rule(tool=NUMBERS, offset=OFFSETS, believed=st.none() | OFFSETS)
    def write_with_a_belief(
        self, tool: int, offset: ToolOffset, believed: ToolOffset | None
    ) -> None:
        refused: RobolinkError | None = None
        try:
            self.controller.tools.write(tool, offset, expected=believed)
        except ToolChangedError as error:
            refused = error
            assert self.held[tool] not in (believed, offset)
        else:
            assert self.held[tool] in (believed, offset)
            self.held[tool] = offset
        assert refused is None or outcome_after(refused).effect is Effect.UNCHANGED

    @precondition(lambda self: not self.unsettled)
    @rule(tool=NUMBERS, then_select=st.none() | st.sampled_from((0, *TOOLS)))
    def clear(self, tool: int, then_select: int | None) -> None:
        expected = self.held[tool]
        in_force = tool == self.selected and expected is not None
        try:
            self.controller.tools.clear(tool, expected=expected, then_select=then_select)
        except SelectedToolError:
            assert in_force
            assert then_select in (None, tool)
        except UndefinedToolError:
            assert in_force
            assert then_select is not None
            assert self.held[then_select] is None
        else:
            self.held[tool] = None
            if in_force:
                assert then_select not in (None, tool)
                self.selected = then_select or 0

    @precondition(lambda self: not self.unsettled)
    @rule(tool=st.sampled_from((0, *TOOLS)))
    def select(self, tool: int) -> None:
        defined = tool == 0 or self.held[tool] is not None
        try:
            self.controller.tools.select(tool)
        except UndefinedToolError:
            assert not defined
        else:
            assert defined or tool == self.selected
            self.selected = tool

    @rule(offsets=st.lists(OFFSETS, min_size=2, max_size=2), wrong=st.booleans())
    def change_two(self, offsets: list[ToolOffset], wrong: bool) -> None:
        believed = ToolOffset(99.0) if wrong else self.held[2]
        wanted = [Wanted(1, offsets[0], self.held[1]), Wanted(2, offsets[1], believed)]
        try:
            change_tools(self.controller, wanted)
        except OutcomeUnknownError:
            assert self.unsettled
        except ToolChangedError:
            assert wrong
            assert self.held[2] != offsets[1]
        else:
            assert not self.unsettled
            self.held[1], self.held[2] = offsets

    @precondition(lambda self: not self.unsettled)
    @rule()
    def undo_the_newest(self) -> None:
        try:
            plan = plan_undo(self.controller)
            undo(self.controller, plan)
        except (ConfigError, ToolChangedError, SelectedToolError):
            return  # there is none, another has written since, or no tool would be selected
        for step in plan.steps:
            self.held[step.tool] = step.requested

    @rule(tool=NUMBERS, offset=OFFSETS)
    def another_writes(self, tool: int, offset: ToolOffset) -> None:
        self.table.put(tool, offset)
        self.held[tool] = offset

    @precondition(lambda self: not self.unsettled)
    @rule(data=st.data(), tool=NUMBERS, offset=OFFSETS, whole=st.booleans())
    def write_with_a_mishap(
        self, data: st.DataObject, tool: int, offset: ToolOffset, whole: bool
    ) -> None:
        mishap, before = data.draw(st.sampled_from(self.table.mishaps)), self.held[tool]
        self.table.plan(mishap)
        try:
            if whole:
                change_tools(self.controller, [Wanted(tool, offset, before)])
            else:
                self.controller.tools.write(tool, offset, expected=before)
        except RobolinkError as error:
            self.table.calm_down()
            now = self.table.held()[tool]
            said = outcome_after(error).effect
            assert now in (before, offset)
            assert now == before or said is not Effect.UNCHANGED
            self.held[tool] = now
        else:
            assert before == offset or mishap == "GARBLE_WRITE" or self.table.held() != self.held
            self.held[tool] = offset
        self.table.calm_down()
        self.unsettled = bool(self.table.journal.open_markers())
        self.connect_again()

    @precondition(lambda self: self.unsettled)
    @rule(keep=st.booleans())
    def recover(self, keep: bool) -> None:
        before = dict(self.held)
        recover(self.controller, keep=keep, confirm=lambda _finding: True)
        now = self.table.held()
        # A value written by another client meanwhile stays; of our own, the old or the new one.
        assert sum(now[tool] != before[tool] for tool in TOOLS) <= 1
        self.held, self.unsettled = now, False

    @rule()
    def connect_again(self) -> None:
        self.controller.close()
        self.controller = self.table.connect()

    @rule()
    def restart(self) -> None:
        self.table.restart()
        with pytest.raises(RobolinkError):
            self.controller.tools.write(1, ToolOffset(1.0), expected=ToolOffset(77.0))
        self.connect_again()
        self.controller.motors(True)
        self.selected = self.table.selected()


class EpsonToolTableMachine(ToolTableMachine):
    kind = EpsonTable


class PlcToolTableMachine(ToolTableMachine):
    kind = PlcTable


def run(machine: type[ToolTableMachine], examples: int, steps: int, **how: Any) -> None:
    run_state_machine_as_test(
        machine,
        settings=settings(
            max_examples=examples,
            stateful_step_count=steps,
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
            phases=(Phase.explicit, Phase.generate, Phase.shrink),  # explaining is slow
            **how,
        ),
    )


MACHINES = {"EPSON": EpsonToolTableMachine, "PLC": PlcToolTableMachine}


@pytest.mark.parametrize("kind", MACHINES)
def test_a_tool_table_is_a_dictionary_whatever_happens(kind):
    run(MACHINES[kind], 3, 14, derandomize=True)


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", MACHINES)
def test_a_tool_table_is_a_dictionary_in_a_thousand_orders(kind):
    run(MACHINES[kind], 1000, 40)
