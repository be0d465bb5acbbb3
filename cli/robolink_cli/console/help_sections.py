"""Help pages whose options stand in groups: a long list is read by what one looks for."""

from gettext import gettext
from typing import Any

import click

from robolink.messages import spoken

HelpSection = tuple[str, frozenset[str]]
"""A heading, declared for translation, and the options below it by their first names."""


class SectionedCommand(click.Command):
    """A command whose help page lists its options under headings.

    Args:
        sections: The headings in their order; what stands in none follows under click's own.
    """

    def __init__(self, *args: Any, sections: tuple[HelpSection, ...], **more: Any) -> None:  # noqa: ANN401 - whatever click takes
        super().__init__(*args, **more)
        self.sections = sections

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of each section, then all others."""
        left = list(self.get_params(ctx))
        for heading, names in self.sections:
            here = [one for one in left if names.intersection(one.opts)]
            left = [one for one in left if one not in here]
            _write(ctx, formatter, spoken(heading), here)
        _write(ctx, formatter, gettext("Options"), left)


def _write(
    ctx: click.Context,
    formatter: click.HelpFormatter,
    heading: str,
    parameters: list[click.Parameter],
) -> None:
    rows = [record for one in parameters if (record := one.get_help_record(ctx)) is not None]
    if rows:
        with formatter.section(heading):
            formatter.write_dl(rows)
