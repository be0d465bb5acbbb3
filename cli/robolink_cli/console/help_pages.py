"""Help pages in the language of the process, with lines broken by columns.

click objects are made when their module is imported, before the language is known, so they hold
English sentences. They are translated when a command is looked up. A Chinese character takes two
columns and has no blank beside it, so click's own way of breaking lines does not do for it.
"""

import inspect
import re
from collections.abc import Iterable, Iterator
from weakref import WeakKeyDictionary

import click

from robolink.messages import spoken
from robolink_cli.console.columns import columns, filled, has_wide

_Texts = tuple[str | None, ...]

_english: "WeakKeyDictionary[click.Command | click.Parameter, _Texts]" = WeakKeyDictionary()
"""What each click object said when it was made."""


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
    english = _english.setdefault(owner, now)
    # What click keeps the lines of is spelled out: a catalogue holds no control character.
    return [text and spoken(_as_collected(text)).replace("\\b\n", "\b\n") for text in english]


def _as_collected(text: str) -> str:
    """Return a docstring without its indent, as the catalogue has it (``tools/sentences.py``)."""
    return inspect.cleandoc(text).partition("\f")[0] if "\n" in text else text


def _paragraphs(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the paragraphs of a text, and whether one keeps its lines, as click has it."""
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


class WideHelpFormatter(click.HelpFormatter):
    """As click's, for pages that hold characters of two columns; English pages stay click's."""

    def write_text(self, text: str) -> None:
        """Write paragraphs with the present indent."""
        if not has_wide(text):
            super().write_text(text)
        else:
            self.write(_wrapped(text, self.width, " " * self.current_indent) + "\n")

    def write_dl(
        self, rows: Iterable[tuple[str, str]], col_max: int = 30, col_spacing: int = 2
    ) -> None:
        """Write names, and beside each what it means."""
        listed = list(rows)
        if not any(has_wide(name + said) for name, said in listed):
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


class WideContext(click.Context):
    """A context whose help pages are written so."""

    formatter_class = WideHelpFormatter
