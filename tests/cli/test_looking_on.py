"""A second person looks while another robolink of this computer has an EPSON controller."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

import robolink
from robolink.stopping import StopListener


@pytest.fixture
def held(state_folder):
    """A served controller that another session has; yields it with its URL."""
    simulator = EpsonSimulator(seed=4)
    with serve_tcp(simulator) as host, robolink.connect(host.url) as controller:

        def seen():
            found = controller.ledger.seen
            return None if found is None else (found[0], controller.clock.now_ns() - found[1])

        with StopListener(controller, host.url, who="ann ('robolink change')", seen=seen):
            yield simulator, controller, host.url


def test_status_shows_who_has_it_and_the_last_state_with_its_age(held, capsys):
    simulator, controller, url = held
    simulator.panel.press_estop()
    controller.status()
    before = controller.exchanges
    assert main.run(["-c", url, "status"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("ann ('robolink change') has this controller.")
    assert " s ago: emergency stop" in out
    assert main.run(["-c", url, "--json", "status"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["schema"] == "robolink/status-beside/1"
    assert said["held_by"].startswith("ann")
    assert said["state"] == "emergency stop"
    assert said["emergency_stop"] is True
    assert 0.0 <= said["age_s"] < 60.0
    assert controller.exchanges == before, "nothing was read for it"


def test_a_holder_that_lets_nobody_look_keeps_nobody_from_asking_the_controller(
    state_folder, capsys
):
    with serve_tcp(EpsonSimulator(seed=4)) as host:
        with robolink.connect(host.url) as controller:
            pass
        with StopListener(controller, host.url, who="ann"):
            assert main.run(["-c", host.url, "--json", "status"]) == 0
    assert json.loads(capsys.readouterr().out)["schema"] == "robolink/status/1"
