"""Two operators in two processes on one cell: their steps, and the required results."""

from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Final

from robolink.model import EntryKind, ToolOffset, read_offset
from tests.faults._change_cell import ChangeCell
from tests.faults._change_process import OLD
from tests.faults._interleavings import Interleavings
from tests.faults._operator_process import Ended, OperatorProcess
from tests.faults._operator_steps import Waiting

Wish = dict[int, ToolOffset]
"""The values that an operator intends for the tools, in writing order."""

Start = Callable[[int], AbstractContextManager[ChangeCell]]
"""Serves the cell of a run, by its number."""

LOST: Final = frozenset({"LeaseHeldError", "LeaseLostError", "ToolChangedError"})
"""The refusals of an operator who has changed nothing."""


@dataclass
class TwoOperators:
    """Implements ``Run``: two processes, and their steps under each epoch.

    Attributes:
        cell: The cell.
        wishes: The intended values of the first and the second.
        unknown: The other possible end on this kind of controller: with an unknown outcome.
        overtaken: The possible end of an operator who had not begun when the other got in between.
    """

    cell: ChangeCell
    wishes: tuple[Wish, Wish]
    unknown: frozenset[str] = frozenset()
    overtaken: frozenset[str] = frozenset()
    epochs: dict[int, set[int]] = field(default_factory=dict)
    writes: Counter[tuple[int, int]] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.operators = [
            OperatorProcess(self.cell.url, self.cell.folder, name, wish)
            for name, wish in zip(("Ann", "Bob"), self.wishes, strict=True)
        ]

    def waiting(self) -> Mapping[int, Waiting]:
        """Return the next step of each operator."""
        states = {who: operator.state for who, operator in enumerate(self.operators)}
        return {who: state for who, state in states.items() if isinstance(state, Waiting)}

    def step(self, who: int) -> None:
        """Let one do the next step."""
        operator = self.operators[who]
        if isinstance(operator.state, Waiting):
            if operator.state.kind == "tool write":
                self.writes[operator.state.epoch, operator.state.tool] += 1
            self.epochs.setdefault(operator.state.epoch, set()).add(who)
        operator.step()
        self.cell.act()

    def ends(self) -> list[str]:
        """The end of each."""
        states = [operator.state for operator in self.operators]
        return [state.how for state in states if isinstance(state, Ended)]

    def abandon(self) -> None:
        """End both at once."""
        for operator in self.operators:
            operator.close()

    def check(self) -> None:
        """Check the result."""
        ends = [operator.end() for operator in self.operators]
        hows = {end.how for end in ends}
        assert hows <= {"done", *LOST, *self.unknown, *self.overtaken}, ends
        assert hows & {"done", *self.unknown}, "nobody got in"
        holders = {epoch: who for epoch, who in self.epochs.items() if epoch}
        assert all(len(who) == 1 for who in holders.values()), "two holders of one epoch"
        assert all(epoch for epoch, _ in self.writes), "a write without the lease"
        assert set(self.writes.values()) <= {1}, "two writes of a tool under one lease"
        if hows & self.unknown:
            self.cell.recover()
        self._check_no_overwrite_was_unseen()
        self._check_each_did_all_or_nothing(ends)
        assert self.cell.journal.open_markers() == ()
        assert self.cell.journal.verify().problems == ()

    def _check_no_overwrite_was_unseen(self) -> None:
        """An operator who wrote a tool had recorded its value before."""
        intents = self.cell.journal.entries(kinds=(EntryKind.INTENT,), newest_first=False)
        named = [
            (
                entry.tool,
                read_offset(entry.details["before"]),
                read_offset(entry.details["requested"]),
            )
            for entry in intents
            if entry.tool is not None
        ]
        for tool, old in OLD.items():
            written = self.cell.values_written(tool)
            seen = [(before, requested) for number, before, requested in named if number == tool]
            assert seen == list(zip((old, *written), written, strict=False)), tool

    def _check_each_did_all_or_nothing(self, ends: list[Ended]) -> None:
        """The tools' values are those after all successful operators, one after the other.

        An operator with an unknown outcome has done all of it, or nothing.
        """
        ended = list(zip(self.wishes, ends, strict=True))
        done = [wish for wish, end in ended if end.how == "done"]
        perhaps = [wish for wish, end in ended if end.how in self.unknown]
        orders = [[*done, *some] for some in ([], perhaps)]
        orders += [order[::-1] for order in orders]
        assert any(self._is_what_is_left_by(order) for order in orders), ends

    def _is_what_is_left_by(self, wishes: list[Wish]) -> bool:
        written: dict[int, list[ToolOffset]] = {tool: [] for tool in OLD}
        for wish in wishes:
            for tool, offset in wish.items():
                written[tool].append(offset)
        held = {tool: (old, *written[tool])[-1] for tool, old in OLD.items()}
        values = {tool: self.cell.values_written(tool) for tool in OLD}
        return (values, self.cell.tools) == (written, held)


def follow_orders(
    orders: Interleavings,
    start: Start,
    wishes: tuple[Wish, Wish],
    *,
    unknown: frozenset[str] = frozenset(),
    overtaken: frozenset[str] = frozenset(),
) -> Counter[str]:
    """Follow orders, check each result, and return the refusals with counts."""
    ends = Counter[str]()
    for number, (beginning, asleep) in enumerate(orders):
        with start(number) as cell:
            run = TwoOperators(cell, wishes, unknown, overtaken)
            try:
                if orders.follow(run, beginning, asleep):
                    run.check()
                    ends.update(how for how in run.ends() if how != "done")
            except AssertionError as error:
                error.add_note(f"after {beginning}")
                raise
    return ends
