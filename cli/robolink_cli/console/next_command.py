"""What comes next: never the command that was refused just now."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import click

from robolink import errors
from robolink.messages import tr
from robolink_cli.command_map import RENAMED

if TYPE_CHECKING:
    from robolink.standing import Standing

_COMMAND: Final = (
    r"""(?P<quote>['"]?)(?P<robolink>robolink(?: -c (?:"[^"]*"|[^\s"']+))?) """
    r"""(?P<words>[a-z][a-z -]*)(?P=quote)(?P<stop>[.\u3002]\s?|(?=\n|$))"""
)
"""One command that ends a sentence or a line; the full stop of Chinese is another one."""


def was_refused(error: BaseException) -> bool:
    """Tell whether the same command would end the same way: no person ended it.

    Args:
        error: What ended it.
    """
    if isinstance(error, errors.NotAllowedError):
        return True
    ended = (errors.DeclinedError, errors.StoppedError, KeyboardInterrupt, EOFError, click.Abort)
    return not isinstance(error, ended)


def next_of(text: str, error: BaseException, standing: "Standing", typed: Sequence[str]) -> str:
    """Return the sentences of an error without the command that it ended as what comes next.

    ``recover`` gives way to what comes before it; of another command nothing stays.

    Args:
        text: The sentences; those of the library know no command that ran.
        error: What ended the command.
        standing: What it left.
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
        commands = recover_after(found["robolink"], again=True, reset_first=standing.reset_first)
        return tr("Next: {command}", command=commands) + found["stop"]

    said = re.escape(tr("Next: {command}", command="").rstrip())
    return re.sub(rf"{said}\s*{_COMMAND}", other, text).rstrip()


def recover_after(robolink: str, *, again: bool, reset_first: bool) -> str:
    """Return the commands that settle what was left open, in the order that works.

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
