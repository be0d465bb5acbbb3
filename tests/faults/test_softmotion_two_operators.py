"""Two operators on one PLC: the lease of a shared journal, the ownership, and the comparison.

Two PCs that share no journal are kept apart by the PLC alone (docs/reference/faults.md F46, F47). A
sample of all orders of their steps is followed; ``ROBOLINK_ALL_KILL_POINTS=1`` follows all.
``pytest -s`` shows how many there are.
"""

import os
from contextlib import contextmanager

import pytest
from robolink_simulators.cell.clock import ScaledClock

from robolink.model import EntryKind, ToolOffset
from tests.contract._softmotion_cell import OWNER_SILENCE_S, SkippingClock
from tests.faults._change_process import OLD
from tests.faults._interleavings import Interleavings
from tests.faults._operator_process import OperatorProcess
from tests.faults._operator_steps import StepKind
from tests.faults._softmotion_change_cell import plc_change_cell
from tests.faults._two_operators import LOST, follow_orders

pytestmark = pytest.mark.timeout(3600)

ANNS, BOBS = ToolOffset(12.1, -3.4, -20.0), ToolOffset(12.2, -3.3, -20.0)


@pytest.fixture
def clock():
    return SkippingClock()


@pytest.fixture
def cell(tmp_path, clock):
    with plc_change_cell(tmp_path / "cell", ScaledClock(base=clock)) as cell:
        yield cell


@pytest.fixture
def other_pc(tmp_path):
    folder = tmp_path / "other PC"
    folder.mkdir()
    return folder


def about_to(cell, kind: StepKind):
    """Return Ann, who owns the mailbox and is about to do a step."""
    ann = OperatorProcess(cell.url, cell.folder, "Ann", {1: ANNS})
    while not cell.owner:
        ann.step()
    ann.advance_to(kind)
    return ann


def bob(cell, folder):
    return OperatorProcess(cell.url, folder, "Bob", {1: BOBS}, stepwise=False).end()


@pytest.mark.fault("F46")
def test_who_shares_the_journal_is_told_who_has_the_lease(cell):
    ann = about_to(cell, "tool write")
    refused = bob(cell, cell.folder)
    assert refused.how == "LeaseHeldError"
    assert "Ann" in refused.said
    assert "WRITE_TOOL 1 (12.1 -3.4 -20" in refused.said
    assert "Wait (" in refused.said
    assert ann.end().how == "done"
    assert cell.values_written() == [ANNS]


@pytest.mark.fault("F46")
def test_who_shares_no_journal_is_told_which_client_owns_the_mailbox(cell, other_pc):
    ann = about_to(cell, "journal write")
    refused = bob(cell, other_pc)
    assert refused.how == "LeaseHeldError"
    assert f"(client {cell.owner:08X}) commands the PLC" in refused.said
    assert "Close it and wait 10 s" in refused.said
    assert ann.end().how == "done"
    assert cell.values_written() == [ANNS]


@pytest.mark.parametrize("frozen_before", ["journal write", "tool write"])
@pytest.mark.fault("F47")
def test_f47_a_frozen_owner_whose_mailbox_was_taken_writes_nothing_when_it_comes_back(
    cell, clock, other_pc, frozen_before
):
    ann = about_to(cell, frozen_before)
    ann.freeze()
    clock.advance(OWNER_SILENCE_S)
    assert bob(cell, other_pc).how == "done"
    ann.thaw()
    refused = ann.end()
    # Her block went out, and the PLC refused it. If her first reading still shows his
    # acknowledgement, the outcome of her write is unknown to her (docs/reference/mailbox.md).
    assert refused.how in {"RejectedError", "OutcomeUnknownError"}
    assert "another client" in refused.said
    assert cell.values_written() == [BOBS]
    assert cell.tools[1] == BOBS


def test_of_two_that_ask_for_the_mailbox_in_the_same_instant_one_gets_it(cell, other_pc):
    ann = OperatorProcess(cell.url, cell.folder, "Ann", {1: ANNS})
    ann.advance_to("mailbox command")
    ann.step()
    refused = bob(cell, other_pc)
    assert refused.how == "LeaseHeldError"
    assert f"(client {cell.owner:08X}) commands the PLC" in refused.said
    # She finds the answer to him; it says that the mailbox is hers.
    assert ann.end().how == "done"
    assert cell.values_written() == [ANNS]


def test_a_write_counts_as_done_when_the_group_s_own_tool_was_read_too(cell, other_pc):
    ann = about_to(cell, "tool write")
    ann.step()
    ann.advance_to("mailbox command")  # she asks which tool the group works with
    ann.step()
    refused = bob(cell, other_pc)
    assert refused.how == "LeaseHeldError", refused.said
    ended = ann.end()
    # His refused request has replaced her answer in the mailbox.
    assert ended.how == "OutcomeUnknownError"
    assert "READ_TOOL" in ended.said
    assert list(cell.journal.entries(kinds=(EntryKind.DONE,))) == []
    cell.recover()
    (done,) = cell.journal.entries(kinds=(EntryKind.DONE,))
    assert done.details["found_later"]
    assert cell.values_written() == [ANNS]


def test_who_compared_before_the_other_wrote_is_told_what_is_there_now(cell, other_pc):
    late = OperatorProcess(cell.url, other_pc, "Bob", {1: BOBS})
    late.advance_to("tool read")
    late.step()
    early = OperatorProcess(cell.url, cell.folder, "Ann", {1: ANNS}, stepwise=False)
    assert early.end().how == "done"
    refused = late.end()
    assert refused.how == "ToolChangedError"
    assert "12.1" in refused.said
    assert cell.values_written() == [ANNS]
    assert cell.tools == {**OLD, 1: ANNS}


UNKNOWN = frozenset({"OutcomeUnknownError"})
"""The mailbox shows only the answer to its last command. If somebody asks for the mailbox and is
refused in between, the owner never sees the outcome of the write.
"""

OVERTAKEN = frozenset({"RemoteProtocolError"})
"""The same for somebody who has asked for the mailbox and has written nothing yet."""


@pytest.mark.fault("F46")
def test_f46_every_order_of_their_steps_ends_with_one_writer_after_the_other(tmp_path):
    whole = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"

    @contextmanager
    def start(number):
        clock = SkippingClock()
        with plc_change_cell(tmp_path / str(number), ScaledClock(base=clock)) as cell:
            cell.skip = clock.advance
            yield cell

    orders = Interleavings(most=None if whole else 6)
    wishes = ({1: ANNS}, {1: BOBS})
    ends = follow_orders(orders, start, wishes, unknown=UNKNOWN, overtaken=OVERTAKEN)
    if whole:
        # The owner of the mailbox cannot lose the lease to somebody who asks for the mailbox first.
        occurring = LOST - {"LeaseLostError"} | UNKNOWN | OVERTAKEN
        assert set(ends) == occurring, "an order that must occur did not"
    print(f"PLC: {orders.seen} orders; refused: {dict(ends)}")  # noqa: T201 - for pytest -s
