"""A click group that loads a command only when that command is used.

click asks for every command object to list their one-line helps, so a group that merely
imports on demand still imports everything for ``--help`` and TAB. This one hands out
stand-ins while it lists (docs/decisions/0005-libraries-chosen.md).
"""

from collections.abc import Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, cast

import click

from robolink.messages import spoken
from robolink_cli.console.help_pages import in_language

if TYPE_CHECKING:
    from collections.abc import Iterator

    from click.shell_completion import CompletionItem


class LazyGroup(click.Group):
    """A group whose commands are named, not imported.

    Args:
        lazy: Command name to ``("package.module:object", one-line help)``, in the order in
            which they are listed.
        aliases: Names of before to ``"package.module:object"``; they are listed nowhere.
    """

    def __init__(
        self,
        *,
        lazy: Mapping[str, tuple[str, str]],
        aliases: Mapping[str, str] | None = None,
        **options: object,
    ) -> None:
        super().__init__(**options)  # type: ignore[arg-type]
        self._lazy = lazy
        self._aliases = aliases or {}
        self.listing = False

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of the table."""
        return [*self._lazy, *super().list_commands(ctx)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command, or while listing its stand-in."""
        if cmd_name in self._aliases:
            target = self._aliases[cmd_name]
        elif cmd_name in self._lazy:
            target, summary = self._lazy[cmd_name]
            if self.listing:
                return click.Command(cmd_name, short_help=spoken(summary))
        else:
            return super().get_command(ctx, cmd_name)
        module, name = target.split(":")
        return in_language(cast(click.Command, getattr(import_module(module), name)))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands in the help page."""
        with self._while_listing():
            super().format_commands(ctx, formatter)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> "list[CompletionItem]":
        """List the commands for TAB."""
        with self._while_listing():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def _while_listing(self) -> "Iterator[None]":
        self.listing = True
        try:
            yield
        finally:
            self.listing = False
