"""A "Next" line never names the command that was refused just now."""

import inspect
import json
import re
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_cli.commands.record import recover as recover_command
from robolink_cli.console.exit_codes import next_of
from robolink_cli.console.language import speaking_for
from robolink_cli.wizard.screens.end import stopped_lines
from robolink_cli.wizard.state import WizardState

from robolink import errors
from robolink.messages import tr
from robolink.standing import UNTOUCHED
from tests.cli.wizard._people import HEADER

URL = "epson+sim://next-command?seed=1"


def all_classes(base=errors.RobolinkError):
    yield base
    for one in base.__subclasses__():
        if one.__module__ == errors.__name__:
            yield from all_classes(one)


def made(kind, remedy):
    """Return an error of a class, its required arguments filled in."""
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


@pytest.mark.parametrize("command", ["recover", "resolve"])
@pytest.mark.parametrize("kind", REFUSED, ids=lambda kind: kind.__name__)
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
        "'robolink recover' may be run again.",
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
