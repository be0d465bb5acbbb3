"""The one place where errors become exit codes and text."""

import os
import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import click
from click.exceptions import NoArgsIsHelpError

from robolink import errors
from robolink.interrupts import EndedBy, Interrupted, ended_by
from robolink.messages import in_english, joined, tr
from robolink_cli.command_map import RENAMED
from robolink_cli.console.error_lines import error_lines
from robolink_cli.console.output import hand_over, sentences, show, terminal_width
from robolink_cli.console.render import dumps

if TYPE_CHECKING:
    from robolink.controller_outcome import Components, ControllerOutcome
    from robolink.plug_ins import PlugInModule


_COMMAND: Final = (
    r"""(?P<quote>['"]?)(?P<robolink>robolink(?: -c (?:"[^"]*"|[^\s"']+))?) """
    r"""(?P<words>[a-z][a-z -]*)(?P=quote)(?P<stop>[.\u3002]\s?|(?=\n|$))"""
)
"""A command that ends a sentence or a line. The Chinese full stop counts too."""


def was_refused(error: BaseException) -> bool:
    """Return whether the same command would end the same way: no person ended it.

    Args:
        error: What ended it.
    """
    if isinstance(error, errors.NotAllowedError):
        return True
    ended = (errors.DeclinedError, errors.StoppedError, KeyboardInterrupt, EOFError, click.Abort)
    return not isinstance(error, ended)


def next_of(
    text: str, error: BaseException, outcome: "ControllerOutcome", typed: Sequence[str]
) -> str:
    """Return an error's sentences without the next command, which the error ended.

    ``recover`` gives way to what comes before it; of another command nothing stays.

    Args:
        text: The sentences; those of the library know no command that ran.
        error: What ended the command.
        outcome: What it left.
        typed: The command line that it ended, without the program's name.
    """
    if not typed or not was_refused(error):
        return text
    refused = {*typed, *(word for one in typed for word in _now_called(one))}

    def other(found: "re.Match[str]") -> str:
        words = found["words"].split()
        if not set(words) <= refused:
            return found[0]
        if words != ["recover"]:
            return ""
        commands = recover_after(found["robolink"], again=True, reset_first=outcome.reset_first)
        return tr("Next: {command}", command=commands) + found["stop"]

    said = re.escape(tr("Next: {command}", command="").rstrip())
    return re.sub(rf"{said}\s*{_COMMAND}", other, text).rstrip()


def recover_after(robolink: str, *, again: bool, reset_first: bool) -> str:
    """Return the commands that recover what was left open, in the order that works.

    A controller in its error state, and one whose emergency stop was released without a reset,
    refuses what ``recover`` has to ask it. Where ``recover`` itself was refused, a look shows
    first whether the controller answers, and what holds it back.

    Args:
        robolink: The program, and the cell where it is named.
        again: Whether ``recover`` was refused just now.
        reset_first: Whether the controller needs a reset.
    """
    if reset_first:
        return f"{robolink} robot reset, then {robolink} recover"
    if again:
        return f"{robolink} status, then {robolink} recover"
    return f"{robolink} recover"


def _now_called(word: str) -> list[str]:
    return RENAMED[word][1].split() if word in RENAMED else []


DONE: Final = 0
DIFFERENT: Final = 1
USAGE: Final = 2
REFUSED: Final = 5
UNKNOWN: Final = 6
BUG: Final = 70
HUNG_UP: Final = 129
INTERRUPTED: Final = 130
READER_LEFT: Final = 141
TERMINATED: Final = 143

_ENDINGS: Final = {
    EndedBy.HUNG_UP: HUNG_UP,
    EndedBy.CTRL_C: INTERRUPTED,
    EndedBy.OUTPUT_CLOSED: READER_LEFT,
    EndedBy.TERMINATED: TERMINATED,
}
"""Exit codes by the way a command was interrupted. All four clean up alike; 6 overrides them."""

MEANINGS: Final[dict[int, str]] = {
    DONE: "done",
    DIFFERENT: (
        "`tool compare` found a difference; `journal verify` or `journal report` "
        "found a damaged record; `journal drift` found something unusual; "
        "`journal move` with `--dry-run` found something in the way; "
        "`check-contract` found a failed check; `cell doctor`, `cell ports` or `cell check` "
        "found something that needs attention; `fleet run` left cells that did not do what was "
        "asked; `fleet next` had no job at the cell; `cell fleet report` shows something that "
        "needs a person"
    ),
    USAGE: "the command, a file, a setting, the journal or an installed package is wrong",
    3: (
        "the controller was not reached, or the link broke; `journal sync` or `journal verify` did "
        "not reach the plant's database"
    ),
    4: "protocol error",
    5: "the controller, or a check of its state, said no",
    UNKNOWN: (
        "robolink could not confirm how a write or movement ended; `robolink recover` comes next"
    ),
    7: "the measurements do not support a result",
    8: "the turn test failed, or its touches were not made; the old value was put back",
    9: "a person said no, or was not there to say yes",
    10: "a stop ended it",
    BUG: "a defect in robolink",
    HUNG_UP: "the window was closed, or the connection to it was lost (SIGHUP)",
    INTERRUPTED: "interrupted (Ctrl-C)",
    READER_LEFT: "a closed pipe: the program that read the output has ended",
    TERMINATED: "terminated (SIGTERM)",
}
"""Meaning of each exit code. docs/commands.md has the same table."""

# The first class that fits decides. A tool number that does not exist is a mistake in the
# command (2). A tool that was changed meanwhile, is undefined, or did not keep what was
# written is a refusal by the controller (5): nothing was rolled back, so it cannot be 8.
EXIT_CODES: Final[tuple[tuple[type[errors.RobolinkError], int], ...]] = (
    (errors.DeclinedError, 9),
    (errors.VerifyError, 8),
    (errors.CalibrationError, 7),
    (errors.OutcomeUnknownError, UNKNOWN),
    (errors.StoppedError, 10),
    (errors.ToolIndexError, USAGE),
    (errors.ReservedToolError, USAGE),
    (errors.ToolError, 5),
    (errors.ControllerError, 5),
    (errors.ProtocolError, 4),
    (errors.TransportError, 3),
    (errors.ConfigError, USAGE),
)


def exit_code(error: BaseException) -> int:
    """Return the exit code that ``error`` stands for.

    What it left on the controller comes first: where a write or a movement may stand unproved,
    it is 6 whatever broke afterwards.
    """
    from robolink.controller_outcome import (
        outcome_after,  # here and below, because --help needs none
    )

    if not outcome_after(error).settled:
        return UNKNOWN
    if isinstance(error, KeyboardInterrupt):
        return _ENDINGS[_ending(error)]
    if isinstance(error, (EOFError, click.Abort)):
        return INTERRUPTED
    if isinstance(error, click.ClickException):
        return USAGE
    if isinstance(error, errors.RobolinkError):
        return exit_code_of(type(error))
    return BUG if _plug_in(error) is None else USAGE


def exit_code_of(kind: type[errors.RobolinkError]) -> int:
    """Return the exit code of an error of a class, where nothing on the controller is open."""
    return next((code for known, code in EXIT_CODES if issubclass(kind, known)), BUG)


def report(error: BaseException, *, as_json: bool, typed: Sequence[str] = ()) -> int:
    """Report ``error`` to a person or a program; return the exit code.

    Args:
        error: What ended a command.
        as_json: Whether a machine is told.
        typed: The command line, without the program's name: it is not proposed again.
    """
    from robolink.controller_outcome import UNTOUCHED, outcome_after

    code = exit_code(error)
    if os.environ.get("ROBOLINK_DEBUG"):
        import traceback  # here, because --help needs none

        show("".join(traceback.format_exception(error)), beside=True)
    if is_cut_off(error) and outcome_after(error) is UNTOUCHED:
        return code  # the reader has closed the pipe on purpose
    if as_json:
        hand_over(error_document(error, typed))
        if isinstance(error, KeyboardInterrupt):  # the reader may be another person
            stands, next_command = _stands(error, typed)
            show(sentences(joined(" ", filter(None, (*stands, next_command)))), beside=True)
    elif isinstance(error, NoArgsIsHelpError):
        show(sentences(error.message), beside=True)
    else:
        what, remedy = _sentences(error, typed)
        stands, next_command = _stands(error, typed)
        width = terminal_width(sys.stderr)
        lines = error_lines(what, remedy, stands=stands, then=next_command, width=width)
        show(lines, beside=True)
    return code


def is_cut_off(error: BaseException) -> bool:
    """Return whether a command ended because nobody reads its output any more."""
    return isinstance(error, Interrupted) and error.by is EndedBy.OUTPUT_CLOSED


def error_document(error: BaseException, typed: Sequence[str] = ()) -> str:
    """Return the JSON document that stands for ``error``; arguments as for :func:`report`."""
    body = error_body(error, typed)
    return dumps("robolink/error/1", {"error": body, "exit_code": exit_code(error)})


def error_body(error: BaseException, typed: Sequence[str] = ()) -> dict[str, object]:
    """Return what is known about ``error``, as plain JSON; arguments as for :func:`report`."""
    from robolink.controller_outcome import outcome_after

    what, remedy = _sentences(error, typed)
    ours = isinstance(error, errors.RobolinkError)
    outcome = outcome_after(error)
    ended = _ending(error) if isinstance(error, KeyboardInterrupt) else ended_by()
    return {
        "kind": type(error).__name__,
        "what": what,
        **_in_english(error),
        "remedy": remedy,
        "reason": getattr(error, "reason", None) if ours else None,
        "code": (getattr(error, "code", None) or None) if ours else None,
        "ended_by": None if ended is None else str(ended),
        "controller_state": outcome.effect,
        "stands": outcome_payload(outcome),
    }


def _in_english(error: BaseException) -> dict[str, object]:
    """Return what happened in English, where a person is told it in another language."""
    if not isinstance(error, errors.RobolinkError) or in_english(error.what) == error.what:
        return {}
    return {"english": in_english(error.what)}


def _ending(error: KeyboardInterrupt) -> EndedBy:
    """Return what ended it; a KeyboardInterrupt without a cause is Ctrl-C."""
    return error.by if isinstance(error, Interrupted) else EndedBy.CTRL_C


def _ending_in_words(by: EndedBy) -> str:
    if by is EndedBy.TERMINATED:
        return tr("Terminated (SIGTERM).")
    if by is EndedBy.HUNG_UP:
        return tr("The window was closed, or the connection to it was lost (SIGHUP).")
    if by is EndedBy.OUTPUT_CLOSED:
        return tr("The command was stopped: the pipe for its output was closed.")
    return tr("You stopped it (Ctrl-C).")


def _sentences(error: BaseException, typed: Sequence[str]) -> tuple[str, str]:
    if isinstance(error, errors.RobolinkError):
        from robolink.controller_outcome import outcome_after

        left = outcome_after(error)
        return next_of(error.what, error, left, typed), next_of(error.remedy, error, left, typed)
    if isinstance(error, click.ClickException):
        from robolink_cli.console.usage_errors import usage_sentences

        return usage_sentences(error)
    if isinstance(error, KeyboardInterrupt):
        return _ending_in_words(_ending(error)), ""
    if isinstance(error, (EOFError, click.Abort)):
        return tr("You stopped it (Ctrl-C)."), ""
    from robolink.plug_ins import unexpected

    plug_in = _plug_in(error)
    if plug_in is None:
        remedy = tr("Set ROBOLINK_DEBUG=1 to see where, and report it with the output.")
    else:
        remedy = tr(
            "Set ROBOLINK_DEBUG=1 to see where, then tell the makers of {package}.",
            package=plug_in.package,
        )
    return unexpected(error), remedy


def _plug_in(error: BaseException) -> "PlugInModule | None":
    from robolink.plug_ins import plug_in_module  # here, because --help needs none

    return plug_in_module(error)


def _stands(error: BaseException, typed: Sequence[str]) -> tuple[list[str], str]:
    """Return what stands, sentence by sentence, and which command settles it.

    Both are empty for a command that had no controller, or only looked.
    """
    from robolink.controller_outcome import UNTOUCHED, outcome_after

    outcome = outcome_after(error)
    if outcome is UNTOUCHED:
        return [], ""
    from robolink.model import outcome_sentences, settling_command  # --help needs none

    told = next_of(settling_command(outcome), error, outcome, typed)
    return outcome_sentences(outcome), told


def outcome_payload(outcome: "ControllerOutcome") -> dict[str, object]:
    """Return what stands, as plain JSON with units in the keys.

    What a tool holds is ``null`` where it is undefined, and where ``known`` is false.
    """
    from robolink.model import json_fields  # here, because --help needs none

    return {
        "tools": {
            str(number): {
                "before": _named(tool.before),
                "requested": _named(tool.requested),
                "holds": _named(tool.holds) if tool.known else None,
                "known": tool.known,
            }
            for number, tool in outcome.tools.items()
        },
        "selected_tool": outcome.selected if outcome.selection_known else None,
        **json_fields(outcome, "selected_before", "carried_out", "doubtful", "moving"),
        **json_fields(outcome, "settled", "left_open"),
    }


def _named(components: "Components") -> dict[str, float] | None:
    from robolink.model import COMPONENTS  # here, because --help needs none

    return None if components is None else dict(zip(COMPONENTS, components, strict=True))
