"""The one place where errors become exit codes and text.

====  =====================================================================
code  meaning
====  =====================================================================
0     done
1     ``compare`` found a difference
2     usage or configuration is wrong; nothing was sent
3     the controller is not reached, or the link broke
4     the two sides do not understand each other
5     the controller, or a check of its state, said no
6     outcome unknown: sent, not answered
7     the measurements do not support a result
8     verification failed; the old value was put back
9     a person declined
70    a defect in robolink
129   the window was closed, or the line to it is gone (SIGHUP)
130   interrupted (Ctrl-C)
141   whoever read the output has left
143   terminated (SIGTERM)
====  =====================================================================

The last four clean up alike, and 6 comes before them: whoever reads one of them knows that
nothing is in doubt.
"""

import os
import sys
from typing import Final

import click

from robolink import errors
from robolink.interrupts import EndedBy, Interrupted, ended_by
from robolink.messages import tr
from robolink_cli._render import dumps

USAGE: Final = 2
BUG: Final = 70
UNKNOWN: Final = 6
INTERRUPTED: Final = 130

_ENDINGS: Final = {
    EndedBy.HUNG_UP: 129,
    EndedBy.CTRL_C: INTERRUPTED,
    EndedBy.OUTPUT_CLOSED: 141,
    EndedBy.TERMINATED: 143,
}

# The first class that fits decides. A tool number that does not exist is a mistake in the
# command (2). A tool that was changed meanwhile, is undefined, or did not keep what was
# written is the controller's no (5): nothing was rolled back, so it cannot be 8.
EXIT_CODES: Final[tuple[tuple[type[errors.RobolinkError], int], ...]] = (
    (errors.DeclinedError, 9),
    (errors.VerifyError, 8),
    (errors.CalibrationError, 7),
    (errors.OutcomeUnknownError, UNKNOWN),
    (errors.ToolIndexError, USAGE),
    (errors.ReservedToolError, USAGE),
    (errors.ToolError, 5),
    (errors.ControllerError, 5),
    (errors.ProtocolError, 4),
    (errors.TransportError, 3),
    (errors.ConfigError, USAGE),
)


def exit_code(error: BaseException) -> int:
    """Return the exit code that ``error`` stands for."""
    if isinstance(error, KeyboardInterrupt):
        in_doubt = getattr(error, "unproved", False)
        return UNKNOWN if in_doubt else _ENDINGS[_ending(error)]
    if isinstance(error, (EOFError, click.Abort)):
        return INTERRUPTED
    if isinstance(error, click.ClickException):
        return USAGE
    return next((code for kind, code in EXIT_CODES if isinstance(error, kind)), BUG)


def report(error: BaseException, *, as_json: bool) -> None:
    """Tell a person, or a machine, about ``error``."""
    if os.environ.get("ROBOLINK_DEBUG"):
        import traceback  # here, because --help needs none

        traceback.print_exception(error)
    if _nobody_cares(error):
        return
    if as_json:
        click.echo(error_document(error))
        state = getattr(error, "state", "") if isinstance(error, Interrupted) else ""
        if state:
            click.echo(state, file=sys.stderr)
    elif isinstance(error, click.ClickException):
        error.show(file=sys.stderr)
    else:
        what, remedy = _sentences(error)
        click.echo(f"robolink: {what}", file=sys.stderr)
        if remedy:
            click.echo(f"  {remedy}", file=sys.stderr)


def _nobody_cares(error: BaseException) -> bool:
    """Tell whether a list was cut off by its reader (``| head``), which is no news to him."""
    if not isinstance(error, Interrupted) or error.by is not EndedBy.OUTPUT_CLOSED:
        return False
    return not getattr(error, "state", "")


def error_document(error: BaseException) -> str:
    """Return the JSON document that stands for ``error``."""
    return dumps("robolink/error/1", {"error": error_body(error), "exit_code": exit_code(error)})


def error_body(error: BaseException) -> dict[str, object]:
    """Return what is known about ``error``, as plain JSON."""
    what, remedy = _sentences(error)
    ours = isinstance(error, errors.RobolinkError)
    ended = _ending(error) if isinstance(error, KeyboardInterrupt) else ended_by()
    return {
        "kind": type(error).__name__,
        "what": what,
        "remedy": remedy,
        "reason": getattr(error, "reason", None) if ours else None,
        "code": (getattr(error, "code", None) or None) if ours else None,
        "ended_by": None if ended is None else str(ended),
    }


def _ending(error: KeyboardInterrupt) -> EndedBy:
    """Return what ended it; a KeyboardInterrupt that does not say so is Ctrl-C."""
    return error.by if isinstance(error, Interrupted) else EndedBy.CTRL_C


def _sentences(error: BaseException) -> tuple[str, str]:
    if isinstance(error, errors.RobolinkError):
        return error.what, error.remedy
    if isinstance(error, click.ClickException):
        return error.format_message(), tr("'robolink COMMAND --help' shows what can be given.")
    if isinstance(error, KeyboardInterrupt):
        return _ending_in_words(_ending(error)), str(getattr(error, "state", ""))
    if isinstance(error, (EOFError, click.Abort)):
        return tr("Interrupted."), ""
    return (
        tr(
            "A defect in robolink: {kind}: {error}",
            kind=type(error).__name__,
            error=error,
        ),
        tr("Set ROBOLINK_DEBUG=1 to see where, and report it with that text."),
    )


def _ending_in_words(by: EndedBy) -> str:
    if by is EndedBy.TERMINATED:
        return tr("Terminated (SIGTERM).")
    if by is EndedBy.HUNG_UP:
        return tr("The window was closed, or the line to it is gone (SIGHUP).")
    if by is EndedBy.OUTPUT_CLOSED:
        return tr("Nobody reads the output any more, so the command was ended.")
    return tr("Interrupted.")
