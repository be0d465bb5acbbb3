"""Copy, Del, Rename and folders, in programs and in the command window.

Source: docs/reference/spel.md 18.
"""

from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.values import as_text
from robolink_simulators.epson.spel.file_folder import FileFolder
from robolink_simulators.epson.spel.tree import KeywordStatement


def _command(count: int, act: Callable[..., None]) -> Callable[[Evaluator, KeywordStatement], str]:
    """Return a statement that does something with one or two names."""

    def go(evaluator: Evaluator, command: KeywordStatement) -> str:
        if len(command.arguments) != count:
            raise SpelRefusal(RefusalKind.SYNTAX, f"{command.name} takes {count} names")
        names = [as_text(evaluator.value(argument)) for argument in command.arguments]
        act(evaluator.session.files, *names)
        return ""

    return go


def _present(evaluator: Evaluator, command: KeywordStatement) -> str:
    """ChDir folder$, or the present folder (assumed)."""
    if not command.arguments:
        return evaluator.session.files.present + "\r\n"
    return _command(1, FileFolder.change)(evaluator, command)


FILE_COMMANDS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "copy": _command(2, FileFolder.copy),
    "del": _command(1, FileFolder.delete),
    "rename": _command(2, FileFolder.rename),
    "mkdir": _command(1, FileFolder.make),
    "rmdir": _command(1, FileFolder.remove),
    "chdir": _present,
    "chdrive": _command(1, FileFolder.change_drive),
}
"""Keyword to what carries it out."""
