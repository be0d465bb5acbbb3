"""Errors of a command: exit codes, sentences and documents."""

import json

import click
import pytest
from robolink_cli import main
from robolink_cli.console import exit_codes

from robolink import errors


def raising(error):
    def act(context):
        raise error

    return act


def every_error():
    waiting = [errors.RobolinkError]
    while waiting:
        kind = waiting.pop()
        waiting += kind.__subclasses__()
        if kind is not errors.RobolinkError and kind.__module__ == "robolink.errors":
            yield kind


def an_error(kind):
    if kind is errors.CalibrationError:
        return kind("too_few_poses", "Only two poses.", remedy="Give three.")
    if kind is errors.NotReadyError:
        reason = errors.NotReadyReason.GUARD_OPEN
        return kind("The guard is open.", reason=reason, remedy="Close it.")
    if kind is errors.AmbiguousPosesError:
        return kind("It went wrong.", asks=("length",), remedy="Do it right.")
    if kind is errors.NotComparedError:
        return kind("It went wrong.", tool=1, components=("y",), remedy="Do it right.")
    return kind("It went wrong.", remedy="Do it right.")


CODES = {
    "ConfigError": 2,
    "AmbiguousPosesError": 2,
    "LimitError": 2,
    "NotComparedError": 2,
    "DocumentError": 2,
    "JournalError": 2,
    "NotAtHomeError": 2,
    "TransportError": 3,
    "ConnectError": 3,
    "LoginUnansweredError": 3,
    "TransportTimeoutError": 3,
    "TransportClosedError": 3,
    "TransportBrokenError": 3,
    "ProtocolError": 4,
    "LocalProtocolError": 4,
    "RemoteProtocolError": 4,
    "UnclearAnswerError": 4,
    "ControllerError": 5,
    "RejectedError": 5,
    "LoginRefusedError": 5,
    "NotReadyError": 5,
    "ControllerFaultError": 5,
    "BusyError": 5,
    "LeaseHeldError": 5,
    "LeaseLostError": 5,
    "MotionTimeoutError": 5,
    "HeartbeatLostError": 5,
    "OutcomeUnknownError": 6,
    "StoppedError": 10,
    "ToolError": 5,
    "ToolIndexError": 2,
    "ReservedToolError": 2,
    "SelectedToolError": 5,
    "UndefinedToolError": 5,
    "ToolChangedError": 5,
    "ReadBackError": 5,
    "CalibrationError": 7,
    "VerifyError": 8,
    "DeclinedError": 9,
    "NotAllowedError": 9,
}


def test_every_error_class_has_its_exit_code():
    assert {kind.__name__: exit_codes.exit_code(an_error(kind)) for kind in every_error()} == CODES


@pytest.mark.parametrize("kind", [*every_error()], ids=lambda kind: kind.__name__)
def test_an_error_says_what_happened_and_what_to_do(command, capsys, kind):
    error = an_error(kind)
    command(raising(error))
    assert main.run(["status"]) == CODES[kind.__name__]
    assert capsys.readouterr() == ("", f"robolink: {error.what}\n  {error.remedy}\n")


def test_an_error_is_one_json_document(command, capsys):
    command(raising(an_error(errors.NotReadyError)))
    assert main.run(["status", "--json"]) == 5
    shown = capsys.readouterr()
    assert json.loads(shown.out) == {
        "schema": "robolink/error/1",
        "error": {
            "kind": "NotReadyError",
            "what": "The guard is open.",
            "remedy": "Close it.",
            "reason": "guard_open",
            "code": None,
            "ended_by": None,
            "controller_state": "unchanged",
            "stands": {
                "tools": {},
                "selected_tool": None,
                "selected_before": None,
                "carried_out": [],
                "doubtful": [],
                "moving": [],
                "settled": True,
                "left_open": False,
            },
        },
        "exit_code": 5,
    }
    assert shown.err == ""


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.RejectedError("No.", code=2435), 2435),
        (an_error(errors.CalibrationError), "too_few_poses"),
    ],
)
def test_the_code_of_an_error_stands_in_its_document(error, code):
    assert json.loads(exit_codes.error_document(error))["error"]["code"] == code


@pytest.mark.parametrize("arguments", [["status", "--json", "--wrong"], ["--json", "wrong"]])
def test_a_usage_error_is_a_document_too(command, capsys, arguments):
    command()
    assert main.run(arguments) == 2
    assert json.loads(capsys.readouterr().out)["exit_code"] == 2


@pytest.mark.parametrize("error", [KeyboardInterrupt(), EOFError(), click.Abort()])
def test_an_interruption_is_130(command, capsys, error):
    command(raising(error))
    assert main.run(["status"]) == 130
    assert capsys.readouterr().err == "robolink: You stopped it (Ctrl-C).\n"


def test_a_defect_is_one_sentence_that_says_how_to_see_more(command, capsys, monkeypatch):
    command(raising(ZeroDivisionError("a / 0")))
    assert main.run(["status"]) == 70
    shown = capsys.readouterr().err
    assert "ZeroDivisionError: a / 0" in shown
    assert "ROBOLINK_DEBUG=1" in shown
    assert "Traceback" not in shown
    monkeypatch.setenv("ROBOLINK_DEBUG", "1")
    assert main.run(["status"]) == 70
    assert "Traceback" in capsys.readouterr().err
