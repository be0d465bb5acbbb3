"""Two operators in two processes on one cell, in every order of their steps (F46, F47).

Each reads one tool or two, then changes them if they still hold the values read. A real controller
serves one client at a time, which one of the tests shows; the others let both log in, so that only
the lease and the comparison keep them apart. A sample of all orders is followed, in which each end
occurs; ``make soak`` follows all of two operators who change one tool, and
``ROBOLINK_ALL_KILL_POINTS=1`` all. ``pytest -s`` shows how many there are.
"""

import os
from functools import cache
from itertools import combinations

import pytest
from robolink_simulators.cell.clock import ManualClock

import robolink
from robolink.errors import LeaseHeldError
from robolink.journal import LEASE_S
from robolink.model import EntryKind, ToolOffset
from robolink.timing import NS_PER_S
from robolink.transaction import Recovery, recover
from tests.faults._change_cell import ChangeCell, change_cell
from tests.faults._change_process import NEW, OLD
from tests.faults._interleavings import Interleavings, apart
from tests.faults._operator_process import OperatorProcess
from tests.faults._operator_steps import Waiting
from tests.faults._two_clients import SharedSimulator
from tests.faults._two_operators import LOST, Wish, follow_orders

pytestmark = pytest.mark.timeout(3600)

ANN: Wish = {1: ToolOffset(12.1, -3.4, -20.0), 2: ToolOffset(-12.1, -3.4, -21.0)}
BOB: Wish = {1: ToolOffset(12.2, -3.3, -20.0), 2: ToolOffset(-12.2, -3.3, -21.0)}
WANTED = (ANN[1], BOB[1])

ALL = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"


def only(wish: Wish, *tools: int) -> Wish:
    return {tool: wish[tool] for tool in tools}


PAIRS = {
    "one tool": (only(ANN, 1), only(BOB, 1)),
    "two tools": (ANN, BOB),
    "two tools, crosswise": (ANN, only(BOB, 2, 1)),
    "two tools and the first of them": (ANN, only(BOB, 1)),
    "two tools and the second of them": (ANN, only(BOB, 2)),
}
ALIKE = ("one tool", "two tools")
"""Both do the same, so it makes no difference which of them goes first."""


@pytest.mark.parametrize(
    ("pair", "most"),
    [
        ("one tool", 16),
        pytest.param("one tool", None, marks=pytest.mark.soak),
        *((pair, 3) for pair in PAIRS if pair != "one tool"),
    ],
)
@pytest.mark.fault("F46")
def test_f46_every_order_of_their_steps_ends_with_one_writer_after_the_other(tmp_path, pair, most):
    orders = Interleavings(alike=pair in ALIKE, most=None if ALL else most)
    ends = follow_orders(
        orders, lambda number: change_cell(tmp_path / str(number), SharedSimulator), PAIRS[pair]
    )
    if pair == "one tool" or ALL:
        assert set(ends) == LOST, "an order that must occur did not"
    print(f"{pair}: {orders.seen} orders; refused: {dict(ends)}")  # noqa: T201 - for pytest -s


steps_apart = cache(apart)


class OnPaper:
    """Implements ``Run`` for two operators who always take the same steps."""

    def __init__(self, *steps):
        self.left = dict(enumerate(map(list, steps)))
        self.done = []

    def waiting(self):
        return {who: left[0] for who, left in self.left.items() if left}

    def step(self, who):
        self.done.append((who, len(self.left[who]), self.left[who].pop(0)))

    def abandon(self):
        pass

    def seen(self):
        """Return the visible part of the order: which came first of two conflicting steps."""
        return frozenset(
            (one[:2], other[:2])
            for one, other in combinations(self.done, 2)
            if one[0] != other[0] and not steps_apart(one[2], other[2])
        )


def steps(*tools, by_mailbox=False):
    """Return the steps of an operator who writes these tools, much simplified."""
    reads = [Waiting("tool read", 0, tool) for tool in tools]
    writes = [Waiting("tool write", 1, tool, by_mailbox) for tool in tools]
    begun, ended = Waiting("journal write", 0), Waiting("journal write", 1)
    return [*reads, Waiting("journal read", 0), *reads, begun, *writes, ended]


@pytest.mark.parametrize(
    ("ann", "bob"),
    [
        (steps(1), steps(1)),
        (steps(1, 2), steps(2)),
        (steps(1), [*steps(1, by_mailbox=True), Waiting("mailbox answer", 1)]),
    ],
)
def test_every_order_that_makes_a_difference_is_followed_once(ann, bob):
    every, alike = set(), ann == bob
    for anns in combinations(range(len(ann) + len(bob)), len(ann)):
        if alike and 0 not in anns:
            continue
        run = OnPaper(ann, bob)
        for number in range(len(ann) + len(bob)):
            run.step(0 if number in anns else 1)
        every.add(run.seen())
    orders, followed = Interleavings(alike=alike), []
    for beginning, asleep in orders:
        run = OnPaper(ann, bob)
        if orders.follow(run, beginning, asleep):
            followed.append(run.seen())
    assert len(followed) == orders.seen == len(set(followed))
    assert set(followed) == every


@pytest.mark.parametrize("second_client", ["ignored", "closed"])
@pytest.mark.fault("F46")
def test_who_is_not_let_in_is_told_who_has_the_lease(tmp_path, second_client):
    with change_cell(tmp_path / "cell", second_client=second_client) as cell:
        ann = OperatorProcess(cell.url, cell.folder, "Ann", {1: WANTED[0]})
        ann.advance_to("tool write")
        bob = OperatorProcess(cell.url, cell.folder, "Bob", {1: WANTED[1]}, stepwise=False)
        refused = bob.end()
        assert refused.how == "LeaseHeldError"
        assert "Ann" in refused.said
        assert "TLSet 1, XY(12.100" in refused.said
        assert "Wait (" in refused.said
        assert ann.end().how == "done"
        assert cell.tools[1] == WANTED[0]
        assert cell.writes() == [1]


@pytest.mark.fault("F47")
def test_f47_a_frozen_holder_whose_lease_was_taken_sends_nothing_when_it_comes_back(tmp_path):
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
    """Recover this long after the holder's last sign of life."""
    outcomes = cell.journal.log(cell.url, clock=ManualClock(round(seconds * NS_PER_S)))
    with robolink.connect(cell.url, outcomes=outcomes) as controller:
        return recover(controller)
