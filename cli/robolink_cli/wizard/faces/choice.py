"""Which face this terminal gets."""

import os
import sys
from typing import TYPE_CHECKING, Final

import click

from robolink_cli.console.output import PLAIN

if TYPE_CHECKING:
    from robolink_cli.wizard.work import Face

_POOR: Final = frozenset({"", "dumb", "unknown"})
"""Terminals that obey nothing."""


def face_here() -> "Face":
    """Return the face for this process's terminal: the full screen where it can be drawn.

    In a small window that one begins with lines.
    """
    if draws_whole_screens():
        from robolink_cli.wizard.faces.full import FullFace

        return FullFace()
    from robolink_cli.wizard.faces.lines import LineFace

    return LineFace()


def draws_whole_screens() -> bool:
    """Tell whether the terminal, and the person at it, take full screens, once there is room."""
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
    return min(size.columns, size.lines) > 0  # where nobody knows the size, none is assumed
