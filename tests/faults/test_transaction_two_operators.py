"""Two operators in two processes on one cell, in every order of their steps (F46, F47).

Each reads tool 1, then changes it if it still holds what he read. A real controller serves
one client at a time, which one of the tests shows; the others let both be logged in, so that
nothing but the lease and the comparison keeps them apart. ``pytest -s`` shows how many orders
there are.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations

import pytest
from robolink_simulators.clock import ManualClock

import robolink
from robolink.errors import LeaseHeldError
from robolink.journal import LEASE_S
from robolink.model import EntryKind, ToolOffset, read_offset
from robolink.timing import NS_PER_S
from robolink.transaction import Recovery, recover
from tests.faults._change_cell import ChangeCell, change_cell
from tests.faults._change_process import NEW, OLD
from tests.faults._interleavings import Interleavings, apart
from tests.faults._operator_process import Ended, OperatorProcess, StepKind, Waiting
from tests.faults._two_clients import SharedSimulator

pytestmark = pytest.mark.timeout(600)

WANTED = (ToolOffset(12.1, -3.4, -20.0), ToolOffset(12.2, -3.3, -20.0))
LOST = ("LeaseHeldError", "LeaseLostError", "ToolChangedError")


@dataclass
class TwoOperators:
    """Implements ``Run``: two processes, and what they did under which epoch."""

    cell: ChangeCell
    epochs: dict[int, set[int]] = field(default_factory=dict)
    writes: Counter[int] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.operators = [
            OperatorProcess(self.cell.url, self.cell.folder, name, {1: offset})
            for name, offset in zip(("Ann", "Bob"), WANTED, strict=True)
        ]

    def waiting(self) -> Mapping[int, Waiting]:
        """Return who stands before which step."""
        states = {who: operator.state for who, operator in enumerate(self.operators)}
        return {who: state for who, state in states.items() if isinstance(state, Waiting)}

    def step(self, who: int) -> None:
        """Let one do his step."""
        operator = self.operators[who]
        if isinstance(operator.state, Waiting):
            if operator.state.kind == "tool write":
                self.writes[operator.state.epoch] += 1
            self.epochs.setdefault(operator.state.epoch, set()).add(who)
        operator.step()

    def ends(self) -> list[str]:
        """How each ended."""
        states = [operator.state for operator in self.operators]
        return [state.how for state in states if isinstance(state, Ended)]

    def abandon(self) -> None:
        """End both where they are."""
        for operator in self.operators:
            operator.close()

    def check(self) -> None:
        """Look at what came of it."""
        ends = [operator.end() for operator in self.operators]
        assert {end.how for end in ends} <= {"done", *LOST}, ends
        assert any(end.how == "done" for end in ends), ends
        holders = {epoch: who for epoch, who in self.epochs.items() if epoch}
        assert all(len(who) == 1 for who in holders.values()), "two holders of one epoch"
        assert 0 not in self.writes, "a write without the lease"
        assert set(self.writes.values()) == {1}, "two writes under one lease"
        self._check_no_overwrite_was_unseen(ends)

    def _check_no_overwrite_was_unseen(self, ends: list[Ended]) -> None:
        written = self.cell.values_written()
        intents = self.cell.journal.entries(kinds=(EntryKind.INTENT,), newest_first=False)
        named = [
            (read_offset(entry.details["before"]), read_offset(entry.details["requested"]))
            for entry in intents
        ]
        assert named == list(zip((OLD[1], *written), written, strict=False))
        assert len(written) == sum(end.how == "done" for end in ends)
        assert self.cell.tools[1] == written[-1]
        assert self.cell.journal.open_markers() == ()
        assert self.cell.journal.verify().problems == ()


def test_every_order_of_their_steps_ends_with_one_writer_after_the_other(tmp_path):
    orders, ends = Interleavings(), Counter[str]()
    for number, (beginning, asleep) in enumerate(orders):
        with change_cell(tmp_path / str(number), SharedSimulator) as cell:
            run = TwoOperators(cell)
            if orders.follow(run, beginning, asleep):
                try:
                    run.check()
                except AssertionError as error:
                    error.add_note(f"after {beginning}")
                    raise
                ends.update(how for how in run.ends() if how != "done")
    assert set(ends) == set(LOST), "an order that must occur did not"
    print(f"{orders.seen} orders; refused: {dict(ends)}")  # noqa: T201 - for pytest -s


class OnPaper:
    """Implements ``Run`` for two operators who always take the same steps."""

    def __init__(self, steps):
        self.left = {who: list(steps) for who in (0, 1)}
        self.done = []

    def waiting(self):
        return {who: Waiting(left[0], 0) for who, left in self.left.items() if left}

    def step(self, who):
        self.done.append((who, len(self.left[who]), self.left[who].pop(0)))

    def abandon(self):
        pass

    def seen(self):
        """Return what can be seen of the order: who came first where two steps conflict."""
        return frozenset(
            (one, other)
            for one, other in combinations(self.done, 2)
            if one[0] != other[0] and not apart(one[2], other[2])
        )


STEPS: tuple[StepKind, ...] = (
    *("tool read", "journal read", "tool read"),
    *("journal write", "tool write", "journal write"),
)


def test_every_order_that_makes_a_difference_is_followed_once():
    every = set()
    for his in combinations(range(1, 2 * len(STEPS)), len(STEPS) - 1):
        run = OnPaper(STEPS)
        for number in range(2 * len(STEPS)):
            run.step(0 if number in (0, *his) else 1)
        every.add(run.seen())
    orders, followed = Interleavings(), []
    for beginning, asleep in orders:
        run = OnPaper(STEPS)
        if orders.follow(run, beginning, asleep):
            followed.append(run.seen())
    assert len(followed) == orders.seen == len(set(followed))
    assert set(followed) == every


@pytest.mark.parametrize("second_client", ["ignored", "closed"])
def test_who_is_not_let_in_is_told_who_has_the_lease(tmp_path, second_client):
    with change_cell(tmp_path / "cell", second_client=second_client) as cell:
        ann = OperatorProcess(cell.url, cell.folder, "Ann", {1: WANTED[0]})
        ann.advance_to("tool write")
        bob = OperatorProcess(cell.url, cell.folder, "Bob", {1: WANTED[1]}, stepwise=False)
        refused = bob.end()
        assert refused.how == "LeaseHeldError"
        assert "Ann" in refused.said
        assert "TLSet 1, XY(12.100" in refused.said
        assert "Nothing was sent. Wait until it has finished" in refused.said
        assert ann.end().how == "done"
        assert cell.tools[1] == WANTED[0]
        assert cell.writes() == [1]


def test_a_frozen_holder_whose_lease_was_taken_sends_nothing_when_it_comes_back(tmp_path):
    with change_cell(tmp_path / "cell", SharedSimulator) as cell:
        ann = OperatorProcess(cell.url, cell.folder, "Ann", NEW)
        # The whole change, the write of tool 1 and its end are stored; that of tool 2 is next.
        ann.advance_to("journal write", count=4)
        ann.freeze()
        assert cell.writes() == [1]
        with pytest.raises(LeaseHeldError, match="Ann"):
            recovered_after(cell, seconds=LEASE_S - 1)
        assert recovered_after(cell, seconds=LEASE_S + 1).left == ()
        assert cell.writes() == [1, 1]
        assert cell.tools == OLD
        ann.thaw()
        assert ann.end().how == "LeaseLostError"
        assert cell.writes() == [1, 1]
        assert cell.tools == OLD
        cell.check_all_is_settled()
        (taken,) = cell.journal.entries(kinds=(EntryKind.LEASE,))
        assert "Ann" in taken.verdict


def recovered_after(cell: ChangeCell, *, seconds: float) -> Recovery:
    """Recover when so much time has passed since the holder's last sign of life."""
    outcomes = cell.journal.log(cell.url, clock=ManualClock(round(seconds * NS_PER_S)))
    with robolink.connect(cell.url, outcomes=outcomes) as controller:
        return recover(controller)
