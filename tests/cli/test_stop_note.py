"""A stop that comes while a command calms the controller: told, and noted until it is released."""

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.controllers import EpsonController
from robolink.stopping import far_end_of, find_note, leave_note

NAME = "stopped-meanwhile"
URL = f"epson+sim://{NAME}"


@pytest.fixture
def stopped_in(monkeypatch):
    """Let somebody at another terminal stop the controller just before a call of it."""
    simulator = EpsonSimulator(seed=4)
    register(NAME, simulator)

    def install(name):
        call = getattr(EpsonController, name)

        def stopped(controller, *given):
            controller.stop()
            leave_note(far_end_of(URL), URL, "mei", confirmed=True)
            return call(controller, *given)

        monkeypatch.setattr(EpsonController, name, stopped)
        return simulator

    yield install
    unregister(NAME)


def test_a_reset_does_not_release_the_stop_that_came_in_the_middle_of_it(stopped_in, capsys):
    simulator = stopped_in("reset_fault")
    assert main.run(["-c", URL, "reset", "--yes"]) == 10
    assert "$Reset" not in [text for _, _, text in simulator.log]  # it was asked for before
    assert "stop" in capsys.readouterr().err
    assert find_note(far_end_of(URL)) is not None
    assert main.run(["-c", URL, "jog", "z+1", "--yes"]) == 10


def test_motors_that_are_switched_off_under_a_stop_are_off_and_the_stop_is_told(stopped_in):
    simulator = stopped_in("motors")
    simulator.machine.switch_motors(True)
    assert main.run(["-c", URL, "motors", "off"]) == 10
    assert not simulator.machine.motors_on
    assert find_note(far_end_of(URL)) is not None


def test_a_reset_after_the_stop_releases_it(stopped_in):
    stopped_in("motors")
    assert main.run(["-c", URL, "motors", "off"]) == 10
    assert main.run(["-c", URL, "reset", "--yes"]) == 0
    assert find_note(far_end_of(URL)) is None
