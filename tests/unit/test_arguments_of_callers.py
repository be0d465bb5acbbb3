"""What a script gives by mistake is named for what it is, and nothing is sent."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from robolink_simulators.faults import Fault, FaultAction, FaultPlan

import robolink
from robolink import ANY, ToolOffset
from robolink.errors import ConfigError, ToolIndexError
from robolink.model import Pose, WorkBox
from robolink.model._movement import MotionProfile


@pytest.fixture
def controller(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    with robolink.connect("epson+sim://arguments") as controller:
        yield controller


def test_numbers_of_numpy_are_numbers(controller):
    given: list[Any] = [np.float32(1.5), np.float64(2.25), np.int32(3), np.int64(30)]
    offset = ToolOffset(*given)
    assert offset == ToolOffset(1.5, 2.25, 3.0, 30.0)
    assert {type(value) for value in offset.components()} <= {int, float, np.float64}
    receipt = controller.tools.write(1, offset, expected=ANY)
    assert receipt.read_back == offset


@pytest.mark.parametrize("value", [np.float32("nan"), np.float64("inf"), "1", None, 1j])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(ConfigError, match="x_mm is not a number"):
        ToolOffset(value)


@pytest.mark.parametrize("tool", ["1", 1.0, True, None])
def test_a_tool_is_named_by_its_number(controller, tool):
    for act in (
        controller.tools.read,
        controller.tools.select,
        lambda it: controller.tools.clear(it, expected=ANY),
        lambda it: controller.tools.write(it, ToolOffset(), expected=ANY),
    ):
        with pytest.raises(ToolIndexError, match="by its number") as caught:
            act(tool)
        assert type(tool).__name__ in caught.value.what


def test_an_offset_is_a_tool_offset(controller):
    before = controller.tools.read(1)
    with pytest.raises(ConfigError, match="An offset is a ToolOffset, not tuple"):
        controller.tools.write(1, (1, 2, 3, 0, 0, 0), expected=ANY)
    with pytest.raises(ConfigError, match="ToolOffset, None or ANY, not"):
        controller.tools.write(1, ToolOffset(1, 2, 3), expected=(1, 2, 3))
    assert controller.tools.read(1) == before


@pytest.mark.parametrize(
    "target", [(1, 2, 3, 4), replace(Pose(1, 2, 3, 4), x_mm=cast("Any", "1")), None]
)
def test_a_target_is_a_pose(controller, target):
    box = WorkBox(-500, 500, -500, 500, -500, 500)
    with pytest.raises(ConfigError, match="A target is a Pose of numbers"):
        controller.groups[0].move_to(target, MotionProfile(), box=box)


@pytest.mark.parametrize("url", [5, None, b"epson+tcp://192.168.0.1"])
def test_what_is_neither_url_nor_controller_is_refused(url):
    with pytest.raises(ConfigError, match="neither a URL nor a controller"):
        robolink.connect(url)


def test_the_action_of_a_fault_may_be_a_word_and_nothing_else():
    plan = FaultPlan(seed=1)
    plan.add(Fault(cast("Any", "drop_reply")))
    assert plan.pending[0].action is FaultAction.DROP_REPLY
    with pytest.raises(ConfigError, match="no fault 'drop_replies'"):
        Fault(cast("Any", "drop_replies"))
