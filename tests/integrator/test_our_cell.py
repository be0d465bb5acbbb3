"""Ten tests by a company that uses robolink, written from its pages alone."""

import json
from concurrent.futures import ThreadPoolExecutor

import pytest

import robolink
from robolink import ToolOffset
from robolink.errors import OutcomeUnknownError, ToolChangedError
from robolink.testing import confirm_whole_map

NEEDLE = ToolOffset(10.0, 0.5, -50.0)


def fit_needle(url, tool=2, password=None):
    """Write the offset that the setter measured, as our line does after a needle change."""
    with robolink.connect(url, password=password) as controller:
        return controller.tools.write(tool, NEEDLE, expected=controller.tools.read(tool))


@pytest.mark.parametrize("epson_sim", ["sim", "tcp", "serial"], indirect=True)
def test_an_epson_gets_the_needle_on_every_link(epson_sim):
    fit_needle(epson_sim.url)
    assert epson_sim.truth()["stored"]["2"]["z_mm"] == -50.0
    epson_sim.wire.assert_sent("TLSet 2, XY", times=1)


@pytest.mark.parametrize(
    "softmotion_sim", ["sim", "modbus-tcp", "modbus-rtu", "can"], indirect=True
)
def test_a_plc_gets_the_needle_on_every_bus(softmotion_sim):
    fit_needle(softmotion_sim.url)
    assert softmotion_sim.truth()["stored"]["2"]["x_mm"] == pytest.approx(10.0)


def test_our_own_plc_gets_the_needle_in_its_registers(plc_sim):
    with robolink.connect(plc_sim.url) as controller:
        confirm_whole_map(controller)
    fit_needle(plc_sim.url)
    assert plc_sim.truth()["stored"]["2"]["x_mm"] == 10.0


def test_the_same_needle_is_not_written_twice(epson_sim):
    fit_needle(epson_sim.url)
    assert fit_needle(epson_sim.url).skipped
    epson_sim.wire.assert_sent("TLSet 2, XY", times=1)
    epson_sim.motions.assert_none()


def test_somebody_else_has_changed_the_tool(epson_sim):
    fit_needle(epson_sim.url)
    with robolink.connect(epson_sim.url) as controller, pytest.raises(ToolChangedError):
        controller.tools.write(2, ToolOffset(1, 1, 1), expected=None)


@pytest.mark.robolink(faults=[{"action": "drop_reply", "match": "TLSet 2, XY"}])
def test_a_lost_answer_leaves_us_in_doubt_and_writes_once(epson_sim, fault_plan):
    with pytest.raises(OutcomeUnknownError):
        fit_needle(epson_sim.url)
    assert len(fault_plan(epson_sim)["fired"]) == 1
    epson_sim.wire.assert_sent("TLSet 2, XY", times=1)


@pytest.mark.robolink(robot="C8-C901S", seed=5)
def test_an_emergency_stop_in_between_is_seen(epson_sim):
    epson_sim.operator.when("GetStatus", "press_estop", skip=1)
    with robolink.connect(epson_sim.url) as controller:
        assert not controller.status().emergency_stop
        assert controller.status().emergency_stop


def test_the_next_batch_starts_as_the_first(softmotion_sim):
    at_first = softmotion_sim.truth()
    for _ in range(2):
        fit_needle(softmotion_sim.url)
        softmotion_sim.do("change_nozzle")
        softmotion_sim.put_back()
        assert softmotion_sim.truth() == at_first


def test_twenty_cells_of_the_plant_at_once(epson_factory):
    cells = [epson_factory(medium="tcp", seed=number) for number in range(20)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda cell: fit_needle(cell.url), cells))
    assert {cell.truth()["stored"]["2"]["z_mm"] for cell in cells} == {-50.0}
    assert len({cell.url for cell in cells}) == 20


@pytest.mark.robolink(true_tool=(12.25, -3.25, -20.0))
def test_the_shift_changes_the_needle_with_our_recipe(epson_cell):
    done = epson_cell.run("change", str(epson_cell.recipe), *epson_cell.by_hand)
    assert done.exit_code == 0, done.messages
    assert json.loads(done.out)["schema"].startswith("robolink/")
    assert epson_cell.truth()["stored"]["1"]["x_mm"] == pytest.approx(12.25, abs=0.06)
