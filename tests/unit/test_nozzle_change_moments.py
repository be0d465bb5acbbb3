"""What a recipe asks and switches between the phases of a change comes at its place, once."""

from typing import cast

import pytest

from robolink.calibration_run import ChangePlan, Listener, Moment, NozzleChange, ToolPlan
from robolink.errors import DeclinedError
from robolink.methods import PointsSource
from robolink.model import Pose, ToolOffset
from robolink.runner import Operator
from robolink.testing import MemoryController, MemoryMachine

OLD = ToolOffset(12, -3.5, -20)
TOUCHES = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)]


class Noting(Listener):
    """Keeps each moment with what the tool holds then; may refuse at one."""

    def __init__(self, machine, *, refuses=None):
        self.machine, self.refuses, self.seen = machine, refuses, []

    def moment(self, moment, context, tool=None):
        self.seen.append((moment, tool, self.machine.read(1) == OLD))
        if moment is self.refuses:
            raise DeclinedError("no")


def run(machine, listener, *, write=True):
    tool = ToolPlan(1, source=PointsSource(lambda: TOUCHES), verify=False)
    plan = ChangePlan((tool,), ask_before_write=False)
    with MemoryController(machine) as controller:
        return NozzleChange(controller, plan, operator=cast(Operator, None), listener=listener).run(
            write=write
        )


def test_each_moment_comes_once_and_the_one_before_the_write_before_it():
    machine = MemoryMachine({1: OLD})
    listener = Noting(machine)
    run(machine, listener)
    assert listener.seen == [
        (Moment.START, None, True),
        (Moment.BEFORE_MEASURE, 1, True),
        (Moment.AFTER_MEASURE, 1, True),
        (Moment.BEFORE_WRITE, None, True),
        (Moment.END, None, False),
    ]


def test_what_is_not_written_has_no_moment_before_it():
    machine = MemoryMachine({1: OLD})
    listener = Noting(machine)
    run(machine, listener, write=False)
    assert Moment.BEFORE_WRITE not in [moment for moment, _, _ in listener.seen]
    assert machine.read(1) == OLD


@pytest.mark.parametrize("refuses", [Moment.START, Moment.BEFORE_MEASURE, Moment.BEFORE_WRITE])
def test_who_refuses_at_a_moment_before_the_write_keeps_the_old_value(refuses):
    machine = MemoryMachine({1: OLD})
    with pytest.raises(DeclinedError):
        run(machine, Noting(machine, refuses=refuses))
    assert machine.read(1) == OLD
