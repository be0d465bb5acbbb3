"""The tool table keeps its contract on every backend."""

import threading

import pytest

from robolink import ANY, ToolOffset
from robolink.errors import (
    BusyError,
    ConfigError,
    ReservedToolError,
    ToolChangedError,
    ToolError,
    ToolIndexError,
    UndefinedToolError,
)

SCRATCH = 15
"""A tool that these tests may write, on hardware too."""

NEW = ToolOffset(11.25, -3.125, -20.5, 0)


@pytest.fixture
def controller(cell):
    with cell.connect() as controller:
        before = controller.tools.read(SCRATCH)
        yield controller
        if before is None:
            controller.tools.clear(SCRATCH, expected=ANY)
        else:
            controller.tools.write(SCRATCH, before, expected=ANY)


def test_there_are_fifteen_tools_and_the_flange_reads_as_zero(controller):
    assert list(controller.tools.indices()) == list(range(1, 16))
    assert list(controller.tools.read_all()) == list(range(1, 16))
    assert controller.tools.read(0) == ToolOffset()


@pytest.mark.on_every_link
def test_one_listing_and_single_reads_agree(controller):
    listed = controller.tools.read_all()
    for tool in (1, 2, SCRATCH):
        single = controller.tools.read(tool)
        if single is None:
            assert listed[tool] is None
        else:
            assert listed[tool].matches(single, 0.0005)


@pytest.mark.on_every_link
def test_a_write_is_read_back_and_receipted(controller):
    before = controller.tools.read(SCRATCH)
    receipt = controller.tools.write(SCRATCH, NEW, expected=before)
    assert (receipt.before, receipt.requested, receipt.skipped) == (before, NEW, False)
    assert receipt.read_back.matches(NEW, 0.0005)
    assert controller.tools.read(SCRATCH).matches(NEW, 0.0005)


def test_an_equal_value_is_not_written_again_whatever_was_expected(controller):
    controller.tools.write(SCRATCH, NEW, expected=ANY)
    receipt = controller.tools.write(SCRATCH, NEW, expected=ToolOffset(9, 9, 9))
    assert receipt.skipped


@pytest.mark.fault("F36")
def test_a_value_equal_after_rounding_is_not_written_again(controller):
    controller.tools.write(SCRATCH, NEW, expected=ANY)
    nearly = ToolOffset(NEW.x_mm + 0.0004, NEW.y_mm, NEW.z_mm)
    assert controller.tools.write(SCRATCH, nearly, expected=NEW).skipped


def test_a_write_is_refused_when_another_value_is_stored(controller):
    controller.tools.write(SCRATCH, NEW, expected=ANY)
    with pytest.raises(ToolChangedError, match=r"holds X 11\.250"):
        controller.tools.write(SCRATCH, ToolOffset(1), expected=ToolOffset(5))
    assert controller.tools.read(SCRATCH).matches(NEW, 0.0005)


def test_an_undefined_tool_reads_as_none_is_a_legal_expectation_and_comes_back_by_clear(
    controller,
):
    controller.tools.clear(SCRATCH, expected=ANY)
    assert controller.tools.read(SCRATCH) is None
    receipt = controller.tools.write(SCRATCH, NEW, expected=None)
    assert receipt.before is None
    cleared = controller.tools.clear(SCRATCH, expected=NEW)
    assert cleared.read_back is None
    assert controller.tools.clear(SCRATCH, expected=None).skipped


def test_an_unconditional_write_says_so(controller):
    assert controller.tools.write(SCRATCH, NEW, expected=ANY).unconditional


def test_an_undefined_tool_is_not_selected(controller):
    controller.tools.clear(SCRATCH, expected=ANY)
    before = controller.tools.selected()
    with pytest.raises(UndefinedToolError):
        controller.tools.select(SCRATCH)
    assert controller.tools.selected() == before
    assert not controller.status().fault


def test_a_selection_is_read_back(controller):
    before = controller.tools.selected()
    controller.tools.select(0)
    assert controller.tools.selected() == 0
    controller.tools.select(before)
    assert controller.tools.selected() == before


@pytest.mark.parametrize("tool", [16, -1, 100, True])
def test_a_tool_number_outside_1_to_15_is_refused_before_anything_is_sent(controller, tool):
    sent = controller.exchanges
    with pytest.raises(ToolIndexError):
        controller.tools.write(tool, NEW, expected=ANY)
    assert controller.exchanges == sent


def test_tool_0_is_never_written(controller):
    sent = controller.exchanges
    with pytest.raises(ReservedToolError):
        controller.tools.write(0, NEW, expected=ANY)
    with pytest.raises(ReservedToolError):
        controller.tools.clear(0, expected=ANY)
    assert controller.exchanges == sent


@pytest.mark.fault("F37")
@pytest.mark.parametrize("bad", [float("nan"), float("inf"), None, "12"])
def test_f37_a_component_that_is_no_number_is_refused_before_anything_is_sent(bad):
    with pytest.raises(ConfigError, match="x_mm"):
        ToolOffset(bad)


@pytest.mark.simulator_only
def test_v_and_w_are_refused_on_four_axes(controller):
    with pytest.raises(ToolError, match="four axes"):
        controller.tools.write(SCRATCH, ToolOffset(1, 2, 3, 0, 5), expected=ANY)


@pytest.mark.simulator_only
def test_an_angle_that_the_controller_wraps_is_the_same_angle(serve, options):
    from robolink_simulators.epson.device import EpsonSimulator

    with serve(EpsonSimulator(seed=1, options=options(angle_wrap=True))) as cell:
        with cell.connect() as controller:
            receipt = controller.tools.write(SCRATCH, ToolOffset(1, 2, 3, 270), expected=ANY)
    assert receipt.read_back.u_deg == -90


@pytest.mark.simulator_only
def test_a_second_thread_is_told_at_once_that_a_procedure_is_under_way(cell):
    with cell.connect() as controller, controller.preserved("a procedure"):
        found = []

        def intrude():
            try:
                controller.tools.write(SCRATCH, NEW, expected=ANY)
            except BusyError as error:
                found.append(error)

        thread = threading.Thread(target=intrude)
        thread.start()
        thread.join()
    assert len(found) == 1


@pytest.mark.simulator_only
def test_flash_is_written_once_per_change_and_never_for_a_skip(serve):
    from robolink_simulators.epson.device import EpsonSimulator

    simulator = EpsonSimulator(seed=1)
    with serve(simulator) as cell, cell.connect() as controller:
        before = simulator.machine.flash_writes
        controller.tools.write(SCRATCH, NEW, expected=ANY)
        controller.tools.write(SCRATCH, NEW, expected=ANY)
        controller.tools.write(SCRATCH, NEW, expected=ANY)
        assert simulator.machine.flash_writes == before + 1
