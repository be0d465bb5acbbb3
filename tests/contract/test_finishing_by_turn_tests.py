"""Recovery finishes a change of two tools by turn tests although conditions have changed."""

import signal
from dataclasses import replace

import pytest

from robolink.calibration_run import finish_by_turn_test, open_turn_tests
from robolink.errors import OutcomeUnknownError, StoppedError, VerifyError
from robolink.methods import TwoPoseSource
from robolink.model import ToolOffset
from robolink.transaction import recover
from tests.contract._sensor_cell import TOOL, sensor_cell
from tests.contract.test_proof_after_a_break import Later

pytestmark = pytest.mark.simulator_only

FOREIGN = ToolOffset(1.0, 2.0, -30.0)
"""A value written by another program."""


@pytest.fixture
def later(tmp_path):
    """A change of tools 1 and 2, both written, cut off before any turn test."""
    with sensor_cell() as cell:
        yield Later(cell, tmp_path)


def broken_off(later, *sources):
    with later.connected() as controller:
        old = [controller.tools.read(tool) for tool, _ in enumerate(sources, start=1)]
    later.broken_off(*sources)
    return old


def settled(controller):
    """Recover everything but the change itself; return its operation."""
    (operation,) = open_turn_tests(controller)
    recover(controller, confirm=lambda _finding: True, later=[operation])
    return operation


def slips(later, by_mm=0.8):
    tips = later.cell.simulator.world.tips
    tips[TOOL] = replace(tips[TOOL], x_mm=tips[TOOL].x_mm + by_mm)


def test_the_second_tool_is_tested_too_each_in_its_own_frame_and_takes_both_back(later):
    old = broken_off(later, TwoPoseSource(), TwoPoseSource())
    in_force = []
    with later.connected() as controller:
        operation = settled(controller)
        tested = later.person()
        ask = tested.ask

        def asked(question, kind):
            in_force.append(later.cell.simulator.machine.tools.selected)
            ask(question, kind)

        tested.ask = asked
        with pytest.raises(VerifyError):
            finish_by_turn_test(
                controller, operation, tested, tell=lambda tool, _: slips(later, 2.0 - tool)
            )
        assert later.verified() == [False, True], "the newest first"
        for tool, value in enumerate(old, start=1):
            assert controller.tools.same(controller.tools.read(tool), value)
        assert controller.outcomes.open_markers() == ()
    assert in_force == [1, 1, 1, 2, 2, 2]


def test_nothing_moves_where_a_tool_holds_another_value_by_then(later):
    (old,) = broken_off(later, TwoPoseSource())
    machine = later.cell.simulator.machine
    with later.connected() as controller:
        operation = settled(controller)
    before = machine.motions.added
    for value in (old, FOREIGN):
        machine.tools.set(1, value)
        with later.connected() as controller:
            assert open_turn_tests(controller) == {}
            with pytest.raises(OutcomeUnknownError):
                finish_by_turn_test(controller, operation, later.person())
            assert len(controller.outcomes.open_markers()) == 1
    assert machine.motions.added == before
    assert later.asked == []


def test_under_a_stop_nothing_is_begun_and_nothing_put_back(later):
    broken_off(later, TwoPoseSource())
    machine = later.cell.simulator.machine
    with later.connected() as controller:
        operation = settled(controller)
        before = machine.motions.added, machine.flash_writes
        controller.stop()
        with pytest.raises(StoppedError):
            finish_by_turn_test(controller, operation, later.person())
        assert len(controller.outcomes.open_markers()) == 1
    assert (machine.motions.added, machine.flash_writes) == before
    assert later.asked == []


def test_ctrl_c_while_the_old_value_is_put_back_waits_until_it_is(later):
    (old,) = broken_off(later, TwoPoseSource())
    slips(later)

    def pressed(_number, request):
        if "TLSet 1," in request:
            signal.raise_signal(signal.SIGINT)

    with later.connected() as controller:
        operation = settled(controller)
        later.cell.simulator.on_request = pressed
        with pytest.raises((KeyboardInterrupt, VerifyError)):
            finish_by_turn_test(controller, operation, later.person())
        assert controller.tools.same(controller.tools.read(1), old)
        assert controller.outcomes.open_markers() == ()


def test_a_value_that_somebody_else_writes_during_the_test_stays(later):
    broken_off(later, TwoPoseSource())
    machine = later.cell.simulator.machine
    slips(later)
    tested = later.person()
    ask = tested.ask

    def asked(question, kind):
        ask(question, kind)
        machine.tools.set(1, FOREIGN)

    tested.ask, later.person = asked, lambda: tested
    with later.connected() as controller:
        with pytest.raises(VerifyError) as failed:
            later.finished(controller)
        assert machine.tools.get(1) == FOREIGN
        assert len(controller.outcomes.open_markers()) == 1
    assert "stays open" in failed.value.what


def test_touches_that_were_not_made_end_the_test_as_failed(later):
    """The first touch is made; at the standoffs the person answers without a jog."""
    later.cell.simulator.machine.tools.set(2, FOREIGN)
    (old,) = broken_off(later, TwoPoseSource())
    tested = later.person()
    poll = tested.poll

    def polled(wait_s):
        answer = poll(wait_s)
        return "done" if answer and len(later.asked) > 1 else answer

    tested.poll = polled
    with later.connected() as controller:
        operation = settled(controller)
        later.cell.simulator.machine.tools.select(2)  # at the pendant
        with pytest.raises(VerifyError) as failed:
            finish_by_turn_test(controller, operation, tested)
        assert failed.value.code == "not_touched"
        assert controller.tools.same(controller.tools.read(1), old)
        assert controller.tools.selected() == 2
