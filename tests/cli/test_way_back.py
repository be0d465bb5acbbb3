"""After an emergency stop or an error: the printed "Next" lines, followed to the letter."""

import re
import shlex
from collections.abc import Callable
from typing import Any

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.errors import ControllerFaultError
from robolink.journal import open_journal
from robolink.model import MarkerKind

STOPS: dict[str, dict[str, Callable[[Any], object]]] = {
    "epson": {
        "emergency stop": lambda panel: panel.press_estop(),
        "guard": lambda panel: panel.open_guard(),
        "error": lambda panel: panel.raise_error(4001),
    },
    "plc": {
        "emergency stop": lambda panel: panel.press_estop(),
        "drive": lambda panel: panel.fail_axis(),
        "permit": lambda panel: panel.withdraw_permit(),
    },
}
CAUSE_GONE: dict[str, Callable[[Any], object]] = {
    "epson": lambda panel: (panel.release_estop(), panel.close_guard()),
    "plc": lambda panel: (panel.release_estop(), panel.give_permit()),
}
SIMULATORS: dict[str, Callable[[], Any]] = {
    "epson": lambda: EpsonSimulator(seed=4, serial="SIM00001"),
    "plc": lambda: SoftMotionSimulator(seed=4),
}
PLACES: dict[str, Any] = {"epson": epson, "plc": softmotion}
CASES = [(kind, stop) for kind, stops in STOPS.items() for stop in stops]


@pytest.fixture(params=CASES, ids=" ".join)
def stopped(request, tmp_path, state_folder):
    """A controller that stopped in a procedure with another tool selected; yields what is run."""
    kind, stop = request.param
    name = f"way-back-{kind}-{stop}".replace(" ", "-")
    simulator: Any = SIMULATORS[kind]()
    place = PLACES[kind]
    place.register(name, simulator)
    url = simulator.url
    try:
        with robolink.connect(url) as controller:
            controller.motors(True)
            controller.tools.select(1)
        with (
            pytest.raises(ControllerFaultError),
            robolink.connect(url) as controller,
            controller.preserved("calibrate tool 1"),
        ):
            controller.tools.select(0)
            controller.begin(MarkerKind.MOVE, "a movement", {"target": [1, 2, 3, 4]})
            STOPS[kind][stop](simulator.panel)
            raise ControllerFaultError("The movement was ended by the controller.")
        yield url, lambda: CAUSE_GONE[kind](simulator.panel)
    finally:
        place.unregister(name)


def next_of(said):
    """Return the commands of the last "Next" lines, in their order, as they would be typed."""
    found = re.findall(r": (robolink -c .*)", said)
    return [shlex.split(part)[1:] for part in found[-1].split(", then ")] if found else []


def test_following_next_ends_settled(stopped, capsys):
    url, cause_gone = stopped
    cause_gone()
    assert main.run(["-c", url, "status"]) == 0
    ways, typed = next_of(capsys.readouterr().err), []
    while ways:
        words = ways.pop(0)
        assert words not in typed, "a cycle, or a command that was just refused"
        typed.append(words)
        code = main.run([*words, "--yes"])
        shown = capsys.readouterr()
        assert code == 0, (words, shown.err)
        ways = next_of(shown.out + shown.err) or ways
        if "recover" in words:
            assert not ways
    assert open_journal().open_markers() == ()
    assert typed
