"""Help pages in the language of the process, with lines broken by columns.

click objects are made when their module is imported, before the language is known, so they hold
English sentences. They are translated when a command is looked up. A Chinese character takes two
columns and has no blank beside it, so click's own way of breaking lines does not do for it.
"""

import inspect
import re
from collections.abc import Iterable, Iterator
from gettext import gettext
from types import TracebackType
from typing import Any
from weakref import WeakKeyDictionary

import click

from robolink.messages import spoken
from robolink_cli.console.tables import columns, filled, has_wide

_Texts = tuple[str | None, ...]

_english: "WeakKeyDictionary[click.Command | click.Parameter, _Texts]" = WeakKeyDictionary()
"""Original English texts of each click object, as the catalogue has them."""


def in_language(command: click.Command) -> click.Command:
    """Return the command, whose texts now are in the language of the process."""
    command.context_class = WideContext
    command.help, command.short_help, command.epilog = _said(
        command, (command.help, command.short_help, command.epilog)
    )
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            (parameter.help,) = _said(parameter, (parameter.help,))
    if isinstance(command, click.Group):
        for one in command.commands.values():
            in_language(one)
    return command


def _said(owner: "click.Command | click.Parameter", now: _Texts) -> list[str | None]:
    english = _english.get(owner)
    if english is None:
        english = _english[owner] = tuple(text and _as_collected(text) for text in now)
    # click's line-keeping mark is spelled out: a catalogue has no control characters.
    return [text and spoken(text).replace("\\b\n", "\b\n") for text in english]


def _as_collected(text: str) -> str:
    """Return a docstring without its indent, as the catalogue has it (``tools/sentences.py``)."""
    return inspect.cleandoc(text).partition("\f")[0] if "\n" in text else text


def _paragraphs(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the paragraphs of a text, and whether one keeps its lines, as click does."""
    for part in re.split(r"\n\s*\n", text.strip("\n")):
        if part.startswith("\b"):
            yield part[1:].lstrip("\n"), True
        else:
            yield part, False


def _wrapped(text: str, width: int, indent: str = "") -> str:
    said = []
    for paragraph, kept in _paragraphs(text):
        if kept:
            said.append("\n".join(indent + line for line in paragraph.splitlines()))
        else:
            said.append(filled(" ".join(paragraph.split()), width, indent=indent))
    return "\n\n".join(said)


def _is_a_line(text: str, width: int) -> bool:
    """Return whether click would write a text unchanged: one line that fits."""
    return 0 < len(text) <= width and text.isprintable() and text == text.strip()


class WideHelpFormatter(click.HelpFormatter):
    """Click's, for pages with characters of two columns; English pages stay click's.

    What fits on its line is written without click's wrapper: to load it and to measure each text
    took two thirds of the time of the front page, after the imports.
    """

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write the line that tells how a command is typed."""
        head = gettext("Usage:") + " " if prefix is None else prefix
        line = f"{head}{prog} {args}"
        whole = args and not self.current_indent and len(line) - len(args) + 20 <= self.width
        if whole and _is_a_line(line, self.width) and _is_a_line(args, self.width):
            self.write(f"{line}\n")
        else:
            super().write_usage(prog, args, prefix)

    def write_text(self, text: str) -> None:
        """Write paragraphs with the present indent."""
        if not has_wide(text):
            if _is_a_line(text, self.width - self.current_indent):
                self.write(f"{' ' * self.current_indent}{text}\n")
            else:
                super().write_text(text)
        else:
            self.write(_wrapped(text, self.width, " " * self.current_indent) + "\n")

    def write_dl(
        self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2
    ) -> None:
        """Write names, and beside each what it means."""
        listed = list(rows)
        if not any(has_wide(name + said) for name, said in listed):
            if not self._wrote_lines(listed, col_max, col_spacing):
                super().write_dl(listed, col_max, col_spacing)
            return
        first = min(max(columns(name) for name, _ in listed), col_max) + col_spacing
        blank = " " * self.current_indent
        for name, said in listed:
            head = f"{blank}{name}"
            if columns(name) > first - col_spacing:
                self.write(f"{head}\n")
                head = blank
            wrapped = _wrapped(said, max(self.width - first - 2, 10)).split("\n")
            gap = " " * (first - columns(head) + self.current_indent)
            self.write(f"{head}{gap}{wrapped[0]}".rstrip() + "\n")
            for line in wrapped[1:]:
                self.write(f"{blank}{' ' * first}{line}\n")

    def _wrote_lines(self, rows: list[tuple[str, str]], col_max: int, col_spacing: int) -> bool:
        """Write a list whose rows are one line each, without wide characters; False for others."""
        most = max((len(name) for name, _ in rows), default=0)
        width = max(self.width - most - col_spacing - 2, 10)
        plain = 0 < most <= col_max and all(
            name.isprintable() and _is_a_line(said, width) for name, said in rows
        )
        for name, said in rows if plain else ():
            self.write(f"{' ' * self.current_indent}{name:{most + col_spacing}}{said}\n")
        return plain


class WideContext(click.Context):
    """A context whose help pages are written in this way, and whose usage errors know it."""

    formatter_class = WideHelpFormatter

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_value: BaseException | None,
        tb: TracebackType | None,
    ) -> bool | None:
        """Leave the context; what was wrong with the command line is told with its command."""
        if isinstance(exc_value, click.UsageError) and exc_value.ctx is None:
            exc_value.ctx = self
        return super().__exit__(exc_type, exc_value, tb)


HelpSection = tuple[str, frozenset[str]]
"""A heading, declared for translation, and the first names of the options below it."""


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
