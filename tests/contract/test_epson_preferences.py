"""Effects of the controller's preferences on tool work, where its firmware reports them."""

from dataclasses import replace

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import options_from_text

from robolink import ToolOffset
from robolink.errors import NotReadyError, NotReadyReason
from robolink.model import InputEdge, MotionProfile, WorkBox
from robolink.protocols.epson_text import Preference
from tests.contract.conftest import served

UNREAL = {"dry_run": NotReadyReason.DRY_RUN, "virtual_io": NotReadyReason.VIRTUAL_IO}


def measure(controller):
    with controller.preserved("a measurement"):
        raise AssertionError("it was begun")


def write(controller):
    old = controller.tools.read(1)
    controller.tools.write(1, ToolOffset(12.5), expected=old)


def clear(controller):
    controller.tools.clear(1, expected=controller.tools.read(1))


def move(controller):
    group = controller.groups[0]
    target = replace(group.pose(), z_mm=group.pose().z_mm + 1)
    group.move_to(target, MotionProfile(), box=WorkBox())


def move_until(controller):
    group = controller.groups[0]
    target = replace(group.pose(), z_mm=group.pose().z_mm + 1)
    group.move_until_input(target, InputEdge(3), speed_mm_s=5, box=WorkBox())


HELD_BACK = [
    *(("dry_run", act) for act in (measure, write, clear, move, move_until)),
    *(("virtual_io", act) for act in (measure, write, clear, move_until)),
]


@pytest.mark.parametrize(
    ("habit", "act"), HELD_BACK, ids=lambda value: getattr(value, "__name__", value)
)
def test_what_an_unreal_cell_would_falsify_is_held_back_before_it_is_sent(habit, act):
    simulator = EpsonSimulator(seed=3, options=options_from_text({habit: "yes"}))
    with served("sim", simulator) as cell, cell.connect() as controller:
        with pytest.raises(NotReadyError) as caught:
            act(controller)
        assert controller.outcomes.open_markers() == ()
        assert controller.status().ready
        assert simulator.machine.flash_writes == 0
        assert simulator.machine.arm.moves_started == 0
    assert caught.value.reason is UNREAL[habit]
    assert "RC+" in caught.value.remedy


@pytest.mark.parametrize("habit", UNREAL)
def test_an_old_value_is_put_back_all_the_same(habit):
    """Otherwise an unconfirmed value would stay stored."""
    simulator = EpsonSimulator(seed=3, options=options_from_text({habit: "yes"}))
    with served("sim", simulator) as cell, cell.connect() as controller:
        unproved, old = controller.tools.read(1), ToolOffset(11.5, -3, -20)
        with controller.latch.putting_back(1):
            controller.tools.write(1, old, expected=unproved)
        assert simulator.machine.tools.get(1) == old


@pytest.mark.parametrize("habit", UNREAL)
def test_firmware_that_does_not_tell_is_not_suspected(habit):
    options = options_from_text({"extended_queries": "no", habit: "yes"})
    with served("sim", EpsonSimulator(seed=3, options=options)) as cell:
        with cell.connect() as controller:
            assert controller.preferences() is None
            assert controller.condition()["preferences"] is None
            write(controller)


def test_they_are_asked_for_once_and_not_before_a_stop():
    simulator = EpsonSimulator(seed=3)
    with served("sim", simulator) as cell, cell.connect() as controller:
        controller.stop()
        controller.status()
        controller.tools.read(1)
        assert not any("GetContSettings" in text for _, _, text in simulator.log)
        controller.release_stop()
        write(controller)
        with controller.preserved("a measurement"):
            move(controller)
        told = controller.preferences()
        assert told is not None
        assert Preference.RESET_OUTPUTS_OFF in told
    asked = [text for _, direction, text in simulator.log if text == "$GetContSettings"]
    assert len(asked) == 1


@pytest.mark.parametrize("settings", ["0101", "0" * 22 + "x", "-1"])
def test_preferences_in_an_unknown_form_tell_nothing(settings):
    simulator = EpsonSimulator(seed=3)
    simulator.card.settings = settings
    with served("sim", simulator) as cell, cell.connect() as controller:
        assert controller.preferences() is None
        write(controller)
