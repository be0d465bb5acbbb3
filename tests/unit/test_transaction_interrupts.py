"""Ctrl-C at each point of a tool change: all of it is kept, or all of it is taken back."""

import signal
from itertools import count

import pytest

from robolink.controllers import EpsonController
from robolink.transaction import ToolChange, change_tools
from tests.unit._transaction_cell import NEW, OLD, tool_cell, wanted


def verified(controller, kept):
    with ToolChange(controller, wanted(1, 2), verify=True) as change:
        change.write()
        controller.status()
        try:
            change.keep("verified")
        finally:
            kept.append(change.kept)


def unverified(controller, kept):
    change_tools(controller, wanted(1, 2))


class Interrupted:
    """Presses Ctrl-C at the ``at``-th instant: at an exchange or after a durable transaction."""

    def __init__(self, cell, log, at):
        self.instants = 0
        self.at = at
        cell.simulator.on_request = cell.simulator.on_reply = self.pass_by
        for name in ("begin", "clear", "append"):
            setattr(log, name, self.passing(getattr(log, name)))

    def passing(self, act):
        def done(*given):
            act(*given)
            self.pass_by()

        return done

    def pass_by(self, *_seen):
        self.instants += 1
        if self.instants == self.at:
            signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("program", [unverified, verified])
def test_ctrl_c_leaves_all_or_nothing_of_a_change(program):
    for at in count(1):
        kept: list[bool] = []
        with tool_cell() as cell:
            log = cell.log()
            with cell.connected(log) as controller:
                interrupted = Interrupted(cell, log, at)
                try:
                    program(controller, kept)
                except KeyboardInterrupt:
                    pass
                else:
                    break
                finally:
                    interrupted.at = 0
            assert cell.tools in (OLD, NEW), at
            assert (cell.tools == NEW) is (kept == [True] or "done" in cell.story()), at
            assert cell.journal.open_markers() == (), at
            # One write there and one back, at most.
            assert cell.writes in (0, 2, 4), at
    assert cell.tools == NEW
    assert at > 30


def test_ctrl_c_while_an_output_is_switched_leaves_nothing_in_doubt():
    for at in count(1):
        with tool_cell() as cell:
            log = cell.log()
            with cell.connected(log) as controller:
                assert isinstance(controller, EpsonController)
                interrupted = Interrupted(cell, log, at)
                try:
                    controller.io.set_output(8, True)
                except KeyboardInterrupt:
                    pass
                else:
                    break
                finally:
                    interrupted.at = 0
            assert cell.journal.open_markers() == (), at
    assert cell.simulator.machine.outputs.get(8)
    assert at > 10
