"""Which face this terminal gets."""

import os
import sys
from typing import TYPE_CHECKING, Final

import click

from robolink_cli.console.tolerance import PLAIN
from robolink_cli.wizard.screens.layout import HEIGHT, WIDTH

if TYPE_CHECKING:
    from robolink_cli.wizard.work import Face

_POOR: Final = frozenset({"", "dumb", "unknown"})
"""Terminals that obey nothing."""


def face_here() -> "Face":
    """Return the face for this process's terminal: the full screen where it can be drawn."""
    if draws_whole_screens():
        from robolink_cli.wizard.faces.full import FullFace

        return FullFace()
    from robolink_cli.wizard.faces.lines import LineFace

    return LineFace()


def draws_whole_screens() -> bool:
    """Tell whether the terminal, and the person at it, take full screens."""
    context = click.get_current_context(silent=True)
    plain = context is not None and bool(context.meta.get(PLAIN))
    if plain or os.environ.get("ROBOLINK_PLAIN") == "1":
        return False
    if os.name != "nt" and os.environ.get("TERM", "") in _POOR:
        return False
    try:
        if os.name == "nt":
            # What prompt_toolkit calls on Windows are functions of stdout's console, whatever it
            # is told to draw on; with stdout in a file there is none, and it breaks off.
            os.get_terminal_size(sys.stdout.fileno())
        size = os.get_terminal_size(sys.stderr.fileno())
    except (OSError, ValueError, AttributeError):
        return False
    # prompt_toolkit keeps off the last column of a Windows console, which would wrap there.
    columns = size.columns - (1 if os.name == "nt" else 0)
    return columns >= WIDTH and size.lines >= HEIGHT
