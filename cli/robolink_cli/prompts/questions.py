"""Asking a person at the terminal before something changes."""

import sys
from typing import Final

import click

from robolink.errors import DeclinedError
from robolink.messages import tr
from robolink_cli.console.tolerance import is_terminal

WATCHED: Final = "robolink.watched"
"""Where a prompt finds the controller whose status it must read while a person thinks."""


def on_terminal() -> bool:
    """Tell whether a person can be asked."""
    return is_terminal(sys.stdin) and is_terminal(sys.stderr)


def agree(question: str, *, yes: bool) -> None:
    """Ask on a terminal; off it, the command itself is the consent (docs/reference/rules.md 7).

    Raises:
        DeclinedError: The answer was no.
    """
    if not yes and on_terminal():
        require_yes(question)


def asked(question: str) -> bool:
    """Ask for a yes; anything else is a no (:func:`robolink.runner.ask_yes_no` says what is)."""
    from robolink.runner import ask_yes_no
    from robolink_cli.prompts.operator import terminal

    return ask_yes_no(terminal(), question, _answer)


def asked_for_text(question: str) -> str:
    """Ask for a line of text.

    Raises:
        DeclinedError: None was typed, or ``q``.
    """
    from robolink.runner import Question
    from robolink_cli.prompts.operator import terminal

    terminal().ask(question, Question.TEXT)
    text = _answer().strip()
    if text in ("", "q"):
        raise DeclinedError(tr("No answer was given."), remedy=tr("Nothing was sent."))
    return text


def _answer() -> str:
    """Return the next line, reading the status between polls of the prompt.

    An idle client is cut off after the remote time-out (docs/reference/epson.md 1.1), and a person
    may take longer than that to look into the cell.
    """
    from robolink.runner import POLL_S
    from robolink_cli.prompts.operator import terminal

    controller = click.get_current_context().meta.get(WATCHED)
    operator = terminal()
    while (line := operator.poll(POLL_S)) is None:
        if controller is not None:
            controller.status()
    return line


def require_yes(question: str) -> None:
    """Ask for a yes.

    Raises:
        DeclinedError: The answer was no.
    """
    if not asked(question):
        raise DeclinedError(tr("That was not y."), remedy=tr("Nothing was sent."))
