"""Taught points are read, never changed, and never requested where they do not exist."""

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point

from robolink.errors import LocalProtocolError, NotReadyError
from robolink.model import Hand, Pose

TAUGHT = {
    901: Point((287.5, 103.25, -50.0, 10.0, 0.0, 0.0)),
    902: Point((-312.5, 96.75, -50.125, -170.0, 0.0, 0.0), hand=Hand.LEFT, local=2, given=4),
}


@pytest.fixture(params=["six", "given"])
def simulator(request, options):
    simulator = EpsonSimulator(seed=7, options=options(point_coordinates=request.param))
    for number, point in TAUGHT.items():
        simulator.machine.points.store(number, point)
    return simulator


def test_points_are_read_with_hand_and_local_and_without_a_tool(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        found = controller.points.read_all((902, 5, 901))
    assert list(found.items()) == [
        (902, Pose(-312.5, 96.75, -50.125, -170.0, hand=Hand.LEFT, local=2)),
        (5, None),
        (901, Pose(287.5, 103.25, -50.0, 10.0, hand=Hand.RIGHT)),
    ]


def test_a_missing_point_leaves_the_controller_without_an_error(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        assert controller.points.read(77) is None
        assert not controller.status().fault


def test_no_points_are_no_exchange(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        before = controller.exchanges
        assert controller.points.read_all(()) == {}
        assert controller.exchanges == before


def test_a_number_that_does_not_exist_is_refused_before_anything_is_sent(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        before = controller.exchanges
        with pytest.raises(LocalProtocolError):
            controller.points.read_all((901, 1000))
        assert controller.exchanges == before


def test_in_teach_nothing_is_read_and_the_remedy_says_so(serve, simulator):
    with serve(simulator) as cell, cell.connect() as controller:
        simulator.panel.teach()
        with pytest.raises(NotReadyError) as caught:
            controller.points.read(901)
        assert caught.value.reason == "teach"
