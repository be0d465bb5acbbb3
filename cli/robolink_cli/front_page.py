"""``robolink --help``: the commands of every day on one page, under headings.

What is on it, and what stands in groups instead, is decided in :mod:`robolink_cli.command_map`;
this draws it. Options are on the page of each command, and all of them together on that of
``robolink expert``.
"""

from collections.abc import Mapping

import click

from robolink.messages import spoken, tr
from robolink_cli.lazy_group import LazyGroup

_NAME_COLUMNS = 9
"""Width of the column of names: that of the longest, "calibrate", so that all sections align."""


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
            tr("Pages to read: robolink docs. Recipes to begin with: robolink recipe list")
        )
        self.format_epilog(ctx, formatter)
