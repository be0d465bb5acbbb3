"""The keys of a simulated cell in a file: the options of its command, and nothing besides.

Each key is the name of an option without its dashes: ``--allow-remote`` is ``allow_remote``. What a
value may be is asked of the option itself, so that file and command line cannot differ.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import click

from robolink.errors import ConfigError
from robolink.files.key_problems import is_not_known
from robolink.messages import tr
from robolink_cli.commands.simulate.serving import host_and_port

ADDRESS: Final = "HOST:PORT"
"""The metavar of an option that takes an address to listen on."""

_OF_THE_RUN: Final = frozenset({"control", "with_parent", "idle_exit", "json", "help", "replay"})
"""Options that say how a process lives, or that serve no simulator at all."""

Objection = Callable[[str, str], None]
"""Is told a key and what is wrong with it."""


class DeclaredKeys:
    """What a table of one kind may hold.

    Args:
        command: The command that serves one simulator of this kind.
        folder: From where relative paths count.
    """

    def __init__(self, command: click.Command, folder: Path) -> None:
        self._command = command
        self._folder = folder
        self.options = {
            key: option
            for option in command.params
            if isinstance(option, click.Option)
            and option.expose_value
            and not option.hidden
            and (key := _key_of(option)) not in _OF_THE_RUN
        }

    def addresses(self) -> Iterator[str]:
        """Yield the keys that take an address to listen on."""
        return (key for key, option in self.options.items() if option.metavar == ADDRESS)

    def values(self, table: Mapping[str, object], object_to: Objection) -> dict[str, Any]:
        """Return the values that the command would be called with; none where one is wrong.

        Args:
            table: What stands in the file.
            object_to: Is told all that is wrong.
        """
        good = True

        def wrong(key: str, what: str) -> None:
            nonlocal good
            good = False
            object_to(key, what)

        line: list[str] = []
        for key in table:
            if key not in self.options:
                wrong(key, is_not_known(key[:80], self.options))
        for key, option in self.options.items():
            if key not in table and option.required:
                wrong(key, tr("is missing"))
            elif key in table:
                try:
                    line += self._typed(option, table[key])
                except click.BadParameter as error:
                    wrong(key, error.message)
                except ConfigError as error:
                    wrong(key, error.what)
        if not good:
            return {}
        try:
            return self._command.make_context("sim", line).params
        except click.UsageError as error:  # options that do not go together
            object_to("", error.message)
            return {}

    def _typed(self, option: click.Option, given: object) -> list[str]:
        """Return what would be typed for a value, if the option takes it.

        Raises:
            click.BadParameter, ConfigError: It is none.
        """
        if option.is_flag:
            if not isinstance(given, bool):
                raise click.BadParameter(tr("must be true or false"))
            return [option.opts[0]] * given
        pieces = self._pieces(option, given) if option.multiple else [self._plain(option, given)]
        if option.metavar == ADDRESS:
            host_and_port(str(given), option.opts[0])
        for piece in pieces:
            option.type.convert(piece, option, None)
        return [f"{option.opts[0]}={piece}" for piece in pieces]

    def _pieces(self, option: click.Option, given: object) -> list[object]:
        if _is_named(option):
            if not isinstance(given, dict):
                raise click.BadParameter(tr("must be a table"))
            return [f"{name}={_as_text(value)}" for name, value in given.items()]
        if not isinstance(given, list):
            raise click.BadParameter(tr("must be a list in brackets"))
        return [self._plain(option, one) for one in given]

    def _plain(self, option: click.Option, given: object) -> object:
        match option.type:
            case click.types.IntParamType():
                if type(given) is not int:
                    raise click.BadParameter(tr("must be a whole number"))
            case click.types.FloatParamType():
                if type(given) not in (int, float):
                    raise click.BadParameter(tr("must be a number"))
            case _:
                if not isinstance(given, str):
                    raise click.BadParameter(tr("must be a text in quotes"))
                if isinstance(option.type, click.Path):
                    return str(self._folder / given)
        return given


def _key_of(option: click.Option) -> str:
    return max(option.opts, key=len).lstrip("-").replace("-", "_")


def _is_named(option: click.Option) -> bool:
    """Tell whether an option is NAME=VALUE, which a file has as a table."""
    return bool(re.fullmatch(r"\w+=\w+", str(option.metavar)))


def _as_text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float, str)):
        return str(value)
    raise click.BadParameter(tr("must be a table of numbers, texts, true or false"))
