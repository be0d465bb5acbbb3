"""Notes and "Next" lines never name the refused command, and work when followed exactly."""

import inspect
import json
import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from robolink_cli import main
from robolink_cli.commands.record import recover as recover_command
from robolink_cli.console.exit_codes import next_of
from robolink_cli.console.language import speaking_for
from robolink_cli.wizard.ending import stopped_lines
from robolink_cli.wizard.state import WizardState
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson, softmotion
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import errors
from robolink.controller_outcome import UNTOUCHED
from robolink.controllers import EpsonController
from robolink.errors import ControllerFaultError
from robolink.journal import open_journal
from robolink.messages import tr
from robolink.model import MarkerKind
from robolink.stopping import find_note, leave_note
from robolink.transport import far_end_of
from tests._rows import in_turn
from tests.cli.wizard._people import HEADER

# A "Next" line never names the command that was refused just now.

URL = "epson+sim://next-command?seed=1"


def all_classes(base=errors.RobolinkError):
    yield base
    for one in base.__subclasses__():
        if one.__module__ == errors.__name__:
            yield from all_classes(one)


def made(kind, remedy):
    """Return an error of a class with its required arguments."""
    more = {}
    for name, one in inspect.signature(kind.__init__).parameters.items():
        if name in ("self", "remedy") or one.default is not inspect.Parameter.empty:
            continue
        if one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD):
            continue
        more[name] = () if name == "asks" else "not_touched" if name == "code" else "It ended."
    return kind(**more, remedy=remedy)


BY_A_PERSON = (errors.DeclinedError, errors.StoppedError)
REFUSED = [
    kind
    for kind in dict.fromkeys(all_classes())
    if kind is errors.NotAllowedError or not issubclass(kind, BY_A_PERSON)
]
SAID = (
    "Next: 'robolink recover'. The robot stays blocked until then.",
    "Look at the robot. Next: robolink recover.",
    'Next: robolink -c "epson+tcp://10.0.0.1:5000" recover',
)


@pytest.mark.parametrize(
    ("kind", "command"), in_turn(REFUSED, ["recover", "resolve"], lambda kind: kind.__name__)
)
def test_recover_refused_never_proposes_recover_alone(kind, command, monkeypatch, capsys):
    texts = iter(SAID)

    def refused(*_args, **_more):
        raise made(kind, next(texts))

    monkeypatch.setattr(recover_command, "open_controller", refused)
    for as_json in ([], ["--json"], []):
        assert main.run(["-c", URL, *as_json, command, "--yes"]) != 0
        shown = capsys.readouterr()
        said = json.loads(shown.out)["error"]["remedy"] if as_json else shown.err
        assert re.search(r"Next: robolink( -c \S+)? status, then robolink( -c \S+)? recover", said)
        assert not re.search(r"Next: '?robolink( -c \S+)? recover", said)


@pytest.mark.parametrize("kind", BY_A_PERSON, ids=lambda kind: kind.__name__)
def test_what_a_person_ended_may_be_begun_again(kind, monkeypatch, capsys):
    def ended(*_args, **_more):
        raise made(kind, SAID[0])

    monkeypatch.setattr(recover_command, "open_controller", ended)
    main.run(["-c", URL, "recover", "--yes"])
    assert "Next: 'robolink recover'." in capsys.readouterr().err


def told(text, *typed):
    return next_of(text, errors.RejectedError("No."), UNTOUCHED, typed)


def test_another_command_that_was_refused_is_dropped_and_others_stay():
    assert told("It is off. Next: robolink robot reset.", "reset") == "It is off."
    assert told("Next: 'robolink status'. Then wait.", "-c", "x", "status") == "Then wait."
    for kept in (
        "Next: robolink robot reset, then robolink recover.",
        "Next: 'robolink recover --forget'.",
        "You can run 'robolink recover' again.",
    ):
        assert told(kept, "recover") == kept
    assert told(SAID[0], "status") == SAID[0]


def test_a_controller_that_needs_a_reset_gets_it_first():
    left = replace(UNTOUCHED, reset_first=True)
    assert next_of(SAID[1], errors.RejectedError("No."), left, ("recover",)) == (
        "Look at the robot. Next: robolink robot reset, then robolink recover."
    )


def test_it_is_so_in_chinese_too():
    with speaking_for(["--lang", "zh"]):
        said = tr("Next: 'robolink recover'. The robot stays blocked until then.")
        assert said != SAID[0]
        changed = told(said, "recover")
    assert "robolink status, then robolink recover\u3002" in changed
    assert "robolink recover'" not in changed


def test_the_last_screen_of_a_refused_recover_names_what_comes_before_it():
    header = replace(HEADER, cell="line3", command="robolink -c line3 recover")
    state = WizardState(header=header)
    for kind in (errors.OutcomeUnknownError, errors.BusyError):
        shown = " ".join(stopped_lines(state, made(kind, SAID[1])))
        assert "status, then robolink" in shown
        assert "Next: robolink recover" not in shown
        assert 'Next: robolink -c "line3" recover' not in shown
    refused = stopped_lines(state, errors.NotAllowedError("It takes an engineer."))
    assert not [line for line in refused if line.startswith("Next:")]
    left = stopped_lines(state, errors.DeclinedError("No."))
    assert left[-1] == "Next: robolink -c line3 recover"


# After an emergency stop or an error: the printed "Next" lines, followed exactly.

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
    """A controller stopped in a procedure with another tool selected; yields a command runner."""
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


def next_line_of(said):
    """Return the commands of the last "Next" lines, in order, as they would be typed."""
    found = re.findall(r": (robolink -c .*)", said)
    return [shlex.split(part)[1:] for part in found[-1].split(", then ")] if found else []


def test_following_next_ends_settled(stopped, capsys):
    url, cause_gone = stopped
    cause_gone()
    assert main.run(["-c", url, "status"]) == 0
    ways, typed = next_line_of(capsys.readouterr().err), []
    while ways:
        words = ways.pop(0)
        assert words not in typed, "a cycle, or a command that was just refused"
        typed.append(words)
        code = main.run([*words, "--yes"])
        shown = capsys.readouterr()
        assert code == 0, (words, shown.err)
        ways = next_line_of(shown.out + shown.err) or ways
        if "recover" in words:
            assert not ways
    assert open_journal().open_markers() == ()
    assert typed


# A stop while a command resets the controller is reported, and noted until it is released.

NAME = "stopped-meanwhile"
NOTED_URL = f"epson+sim://{NAME}"


@pytest.fixture
def stopped_in(monkeypatch):
    """Let somebody at another terminal stop the controller just before a call of it."""
    simulator = EpsonSimulator(seed=4)
    register(NAME, simulator)

    def install(name):
        call = getattr(EpsonController, name)

        def stopped(controller, *given):
            controller.stop()
            leave_note(far_end_of(NOTED_URL), NOTED_URL, "mei", confirmed=True)
            return call(controller, *given)

        monkeypatch.setattr(EpsonController, name, stopped)
        return simulator

    yield install
    unregister(NAME)


def test_a_reset_does_not_release_the_stop_that_came_in_the_middle_of_it(stopped_in, capsys):
    simulator = stopped_in("reset_fault")
    assert main.run(["-c", NOTED_URL, "reset", "--yes"]) == 10
    assert "$Reset" not in [text for _, _, text in simulator.log]  # it was asked for before
    assert "stop" in capsys.readouterr().err
    assert find_note(far_end_of(NOTED_URL)) is not None
    assert main.run(["-c", NOTED_URL, "jog", "z+1", "--yes"]) == 10


def test_motors_that_are_switched_off_under_a_stop_are_off_and_the_stop_is_told(stopped_in):
    simulator = stopped_in("motors")
    simulator.machine.switch_motors(True)
    assert main.run(["-c", NOTED_URL, "motors", "off"]) == 10
    assert not simulator.machine.motors_on
    assert find_note(far_end_of(NOTED_URL)) is not None


def test_a_reset_after_the_stop_releases_it(stopped_in):
    stopped_in("motors")
    assert main.run(["-c", NOTED_URL, "motors", "off"]) == 10
    assert main.run(["-c", NOTED_URL, "reset", "--yes"]) == 0
    assert find_note(far_end_of(NOTED_URL)) is None
