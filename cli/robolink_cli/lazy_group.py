"""A click group that loads a command only when that command is used.

click asks for every command object to list their one-line helps, so a group that merely
imports on demand still imports everything for ``--help`` and TAB. This one hands out
stand-ins while it lists (docs/decisions/0005-libraries-chosen.md).
"""

import sys
from collections.abc import Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, cast

import click

from robolink.messages import spoken, tr
from robolink_cli.console.help_pages import in_language
from robolink_cli.console.render import note

if TYPE_CHECKING:
    from collections.abc import Iterator

    from click.shell_completion import CompletionItem


class LazyGroup(click.Group):
    """A group whose commands are named, not imported.

    Args:
        lazy: Command name to ``("package.module:object", one-line help)``, in the order in
            which they are listed, after the commands that were added to the group itself.
        unlisted: Names that work and are listed nowhere, to ``"package.module:object"``.
        renamed: Former names, to ``("package.module:object", full name of today)``. They are
            listed nowhere; on a terminal a line says how the command is called now.
    """

    def __init__(
        self,
        *,
        lazy: Mapping[str, tuple[str, str]],
        unlisted: Mapping[str, str] | None = None,
        renamed: Mapping[str, tuple[str, str]] | None = None,
        **options: object,
    ) -> None:
        super().__init__(**options)  # type: ignore[arg-type]
        self.lazy = lazy
        self.renamed = renamed or {}
        self._unlisted = dict(unlisted or {}) | {
            name: target for name, (target, _) in self.renamed.items()
        }
        self.listing = False

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's form
        """Return the names in the order of the tables."""
        return [*self.commands, *self.lazy]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command, or while listing its stand-in."""
        if cmd_name in self._unlisted:
            target = self._unlisted[cmd_name]
        elif cmd_name in self.lazy:
            target, summary = self.lazy[cmd_name]
            if self.listing:
                return click.Command(cmd_name, short_help=spoken(summary))
        else:
            return super().get_command(ctx, cmd_name)
        module, name = target.split(":")
        return in_language(cast("click.Command", getattr(import_module(module), name)))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the typed command; report a former name."""
        found = super().resolve_command(ctx, args)
        if args[0] in self.renamed and not ctx.resilient_parsing and sys.stderr.isatty():
            typed = " ".join([*ctx.command_path.split()[1:], args[0]])
            now = self.renamed[args[0]][1]
            note(tr("{old} is now called {new}.", old=typed, new=now))
        return found

    def typed_names(self, ctx: click.Context) -> list[str]:
        """Return the names of today: those that are listed, and those that are not."""
        return [*self.list_commands(ctx), *(self._unlisted.keys() - self.renamed.keys())]

    def groups_with(self, ctx: click.Context, typed: str) -> list[str]:
        """Return the commands of that name in groups whose one-line help names it."""
        found = []
        for group, (_, summary) in self.lazy.items():
            if typed in summary.split():
                command = self.get_command(ctx, group)
                if isinstance(command, click.Group) and typed in command.list_commands(ctx):
                    found.append(" ".join([ctx.command_path, group, typed]))
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands in the help page."""
        with self.while_listing():
            super().format_commands(ctx, formatter)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> "list[CompletionItem]":
        """List the commands for TAB."""
        with self.while_listing():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def while_listing(self) -> "Iterator[None]":
        """Return stand-ins within the block: names and one-line helps, nothing loaded."""
        self.listing = True
        try:
            yield
        finally:
            self.listing = False


_NAME_COLUMNS = 9
"""Width of the column of names: that of "calibrate", the longest, so that all sections align."""


class FrontPage(LazyGroup):
    """The root of the commands.

    Args:
        sections: Heading to its commands, as :class:`LazyGroup` takes them.
    """

    def __init__(
        self, *, sections: Mapping[str, Mapping[str, tuple[str, str]]], **options: object
    ) -> None:
        commands = {name: found for part in sections.values() for name, found in part.items()}
        super().__init__(**options | {"lazy": commands})  # type: ignore[arg-type]
        self._sections = sections

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the page: the usage line, the sections, and where the rest is."""
        names = {name for parameter in self.get_params(ctx) for name in parameter.opts}
        language = "[--lang zh|en] " if "--lang" in names else ""
        formatter.write_usage(ctx.command_path, f"[-c CELL] {language}[--json] COMMAND ...")
        for heading, commands in self._sections.items():
            formatter.write_paragraph()
            formatter.write(f"{spoken(heading)}\n")
            formatter.indent()
            formatter.write_dl(
                [
                    (name.ljust(_NAME_COLUMNS), spoken(summary))
                    for name, (_, summary) in commands.items()
                ]
            )
            formatter.dedent()
        formatter.write_paragraph()
        formatter.write_text(tr("First time here? robolink demo. More: robolink expert --help"))
        formatter.write_text(
            tr("Documentation: robolink docs. Recipes to start from: robolink recipe list")
        )
        self.format_epilog(ctx, formatter)
