"""Whatever tool is in force: it is the flange that a measurement moves, and goes on with."""

from typing import Any

import pytest

from robolink.calibration import Pin
from robolink.calibration_run import Limits
from robolink.errors import DeclinedError
from robolink.methods import Absolute, NAngleSource, OneTouchSource, TwoPoseSource
from robolink.model import Pose, ToolOffset
from robolink.procedures import MeasurementContext
from robolink.testing import MemoryController, MemoryMachine, PaperCell

STORED = ToolOffset(12.0, -4.0, -20.0)
SOURCES: dict[str, Any] = {
    "two-pose": TwoPoseSource(),
    "n-angle": NAngleSource((120.0, 240.0)),
    "one-touch": OneTouchSource(Absolute(Pin(310.0, 0.0, 60.0), 0.02)),
}


class Leaves:
    """Looks which tool is in force when something is asked, and goes."""

    def __init__(self, controller):
        self.selected = []
        self._controller = controller

    def tell(self, text):
        pass

    def ask(self, question, kind):
        self.selected.append(self._controller.tools.selected())

    def poll(self, wait_s):
        return "q"


@pytest.mark.parametrize("method", SOURCES)
def test_tool_zero_is_selected_before_a_touch_is_asked_for(method):
    source = SOURCES[method]
    with MemoryController(MemoryMachine({1: STORED})) as controller:
        start = controller.groups[0].pose()
        cell = PaperCell(Pose(*start.coordinates(), tool=0), STORED, (310.0, 0.0, 60.0))
        result = cell.run(source.procedure(STORED, cell.here))
        person = Leaves(controller)
        context = MeasurementContext(controller, person, start=start, settings=Limits().settings)
        for again in (None, 0):
            for steps in (
                lambda: source.measure(context, 1, STORED),
                lambda again=again: source.further(context, STORED, result, again),
            ):
                controller.tools.select(1)
                with pytest.raises(DeclinedError):
                    steps()
        assert person.selected == [0, 0, 0, 0]
