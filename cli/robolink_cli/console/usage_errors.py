"""What a person is told of a command line that cannot be read: what is wrong, and what to type.

click raises the errors and words them for programmers. Here they get the form of all others
(docs/contributing.md, "Adding a sentence, or a translation"); what click's own message holds, such
as the words that were too many, is read out of it by click's own template.
"""

import re
from gettext import gettext, ngettext
from typing import Any, Final

import click
from click.core import ParameterSource
from click.exceptions import NoArgsIsHelpError, NoSuchCommand

from robolink.messages import joined, tr
from robolink_cli.console.tables import SCREEN, within

EXAMPLES: Final = {
    "a": "1",
    "act": "look",
    "b": "2",
    "bit": "1",
    "file": "tools.json",
    "files": "main.prg",
    "folder": "export",
    "kind": "Long",
    "map_file": "machine.toml",
    "name": "PIN-07",
    "number": "1",
    "person": "Chen",
    "plan": "0123456789ab",
    "points": "901-902",
    "reason": '"first ring looked at"',
    "row": "touch_mm",
    "shell": "bash",
    "statement": '"Print Tool"',
    "station": "PIN-07",
    "switch": "on",
    "tool": "1",
    "until": "2026-12-24",
    "url": "assist+tcp://127.0.0.1:5001",
    "value": "1",
    "cell fleet plan file": "plan.toml",
    "fleet plan file": "plan.toml",
    "expert poses show file": "poses.csv",
    "expert recipe check file": "needle.toml",
    "expert recipe new name": "needle-pin",
    "expert solve file": "poses.csv",
    "journal export file": "journal.csv",
    "journal move to": "new.db",
    "journal show name": "1",
    "robot variable get name": "g_Long",
    "robot variable set name": "g_Long",
    "sim ctl url": "http://127.0.0.1:8080",
    "sim run file": "cells.toml",
}
"""An example value of each required parameter, by its name or by the command's name and its own."""

_MOST_LINES: Final = 3
_LONGEST_VALUE: Final = 40
_LONGEST_LIST: Final = 72
_MINUS: Final = re.compile(r"-[\d.]+")
_NEAR: Final = 0.7
"""Least similarity of two words, from 0 to 1, at which one is suggested for the other."""


def usage_sentences(error: click.ClickException) -> tuple[str, str]:
    """Return what is wrong with a command line, and what to type.

    Args:
        error: What click raised.
    """
    context: click.Context | None = getattr(error, "ctx", None)
    match error:
        case click.NoSuchOption():
            return _no_such_option(error, context)
        case NoSuchCommand():
            near = _commands_like(error.command_name, context)
            return tr("No command {word}.", word=_quoted(error.command_name)), joined(
                " ", (*_meant(near), _help(context))
            )
        case click.MissingParameter() if error.param is not None and context is not None:
            return _missing(error.param, context)
        case click.BadParameter() if error.param is not None:
            return _wrong_value(error.message, error.param, context)
        case click.BadOptionUsage():
            return _wrong_option(error, context)
    if isinstance(error, NoArgsIsHelpError) or error.message == gettext("Missing command."):
        return tr("A command is missing."), _help(context)
    if context is not None and (words := _extra_words(error.message)):
        return tr("Too many words: {words}.", words=_cut(words)), tr(
            "Type: {form}", form=_form(context)
        )
    return _ended(error.message), _help(context)


def example_of(context: click.Context) -> str:
    """Return a command line with all that the command of a context needs.

    Args:
        context: It.
    """
    command = context.command_path.partition(" ")[2]
    words = [context.command_path]
    for one in context.command.params:
        if one.required:
            value = EXAMPLES.get(f"{command} {one.name}") or EXAMPLES[str(one.name)]
            words += [value] if isinstance(one, click.Argument) else [_long_name(one), value]
    return " ".join(words)


def _no_such_option(error: click.NoSuchOption, context: click.Context | None) -> tuple[str, str]:
    if _MINUS.fullmatch(error.option_name) and context is not None:
        return tr("robolink reads {word} as an option.", word=error.option_name), tr(
            "Put -- before a number with a minus: {command} -- {word}",
            command=context.command_path,
            word=error.option_name,
        )
    names = [] if context is None else [name for one in context.command.params for name in one.opts]
    near = _alike(error.option_name, names)
    said = tr("No option {option}.", option=_cut(error.option_name))
    return said, joined(" ", (*_meant(near), _help(context)))


def _missing(parameter: click.Parameter, context: click.Context) -> tuple[str, str]:
    said = [tr("{name} is missing.", name=_named(parameter))]
    if isinstance(parameter, click.Option) and parameter.help:
        said.append(_first_sentence(parameter.help))
    else:
        said.append(tr("The form is: {form}.", form=_form(context)))
    do = tr("For example: {command}", command=example_of(context))
    if parameter.name == "station":
        do = joined(" ", (tr("To see the stations: robolink cell station list."), do))
    return joined(" ", said), do


def _wrong_value(
    message: str, parameter: click.Parameter, context: click.Context | None
) -> tuple[str, str]:
    name, kind = _named(parameter, context), parameter.type
    needed = _needed(kind)
    if isinstance(kind, click.Path):
        said, needed = _about_path(message, kind)
    elif (value := _refused_value(message, kind)) is not None:
        said = tr("{name} cannot be {value}.", name=name, value=_cut(value))
        if isinstance(kind, click.Choice):
            near = _alike(value.strip("'"), map(str, kind.choices))
            needed = needed or joined(" ", _meant(near))
    else:
        said = _ended(f"{name}: {_cut(message)}")
    return said, joined(" ", (*([needed] if needed else []), _help(context)))


def _wrong_option(error: click.BadOptionUsage, context: click.Context | None) -> tuple[str, str]:
    option = error.option_name
    takes_none = gettext("Option {name!r} does not take a value.").format(name=option)
    if error.message == takes_none:
        return tr("{option} takes no value.", option=option), tr(
            "Type {option} alone.", option=option
        )
    found = [] if context is None else [one for one in context.command.params if option in one.opts]
    needed = _needed(found[0].type) if found else ""
    do = joined(" ", (*([needed] if needed else []), _help(context)))
    said = tr("{option} needs a value.", option=option)
    for one in found:
        if isinstance(one, click.Option) and one.help:
            longer = joined(" ", (said, _first_sentence(one.help)))
            said = longer if _fits(longer, do) else said
    return said, do


def _fits(said: str, do: str) -> bool:
    """Tell whether an answer takes three lines of a narrow terminal."""
    shown = within(f"robolink: {said}\n  {do}", SCREEN)
    return shown.count("\n") < _MOST_LINES


def _needed(kind: "click.ParamType[Any]") -> str:
    """Return the sentence that asks for a value of a type; empty where its help says more."""
    if isinstance(kind, click.DateTime):
        return tr("Give a day in the form 2026-05-31.")
    if isinstance(kind, click.Choice):
        choices = ", ".join(map(str, kind.choices))
        return tr("Give one of: {choices}.", choices=choices) * (len(choices) <= _LONGEST_LIST)
    whole = isinstance(kind, click.types.IntParamType)
    if not whole and kind.name not in ("float", "float range"):
        return ""
    low, high = getattr(kind, "min", None), getattr(kind, "max", None)
    if low is None:
        return tr("Give a whole number.") if whole else tr("Give a decimal number.")
    if high is None:
        if getattr(kind, "min_open", False):
            return tr("Give a number above {low:g}.", low=low)
        if whole:
            return tr("Give a whole number, {low} or more.", low=low)
        return tr("Give a number, {low:g} or more.", low=low)
    if whole:
        return tr("Give a whole number from {low} to {high}.", low=low, high=high)
    return tr("Give a number from {low:g} to {high:g}.", low=low, high=high)


def _about_path(message: str, kind: click.Path) -> tuple[str, str]:
    """Return what is wrong with a file or a folder, and what to give."""
    path = _found(gettext("{name} {filename!r} does not exist."), message, "filename")
    if path is not None:
        if kind.file_okay:
            return tr("There is no file {path}.", path=path), tr("Give a file that exists.")
        return tr("There is no folder {path}.", path=path), tr("Give a folder that exists.")
    path = _found(gettext("{name} {filename!r} is a directory."), message, "filename")
    if path is not None:
        return tr("{path} is a folder.", path=path), tr("Give a file.")
    path = _found(gettext("{name} {filename!r} is a file."), message, "filename")
    if path is not None:
        return tr("{path} is a file.", path=path), tr("Give a folder.")
    return _ended(message), tr("Check the file and its permissions.")


def _refused_value(message: str, kind: "click.ParamType[Any]") -> str | None:
    """Return the value, as it is shown, that one of click's own messages is about."""
    if isinstance(kind, click.Choice):
        templates = _counted("{value!r} is not {choice}.", "{value!r} is not one of {choices}.")
    elif isinstance(kind, click.DateTime):
        templates = _counted(
            "{value!r} does not match the format {format}.",
            "{value!r} does not match the formats {formats}.",
        )
    else:
        templates = (
            gettext("{value} is not in the range {range}."),
            gettext("{value!r} is not a valid {number_type}."),
        )
    for template in templates:
        if (value := _found(template, message, "value")) is not None:
            return value.removesuffix(".0") if "{value}" in template else value
    return None


def _extra_words(message: str) -> str:
    templates = _counted(
        "Got unexpected extra argument ({args})", "Got unexpected extra arguments ({args})"
    )
    return next(filter(None, (_found(one, message, "args") for one in templates)), "")


def _counted(singular: str, plural: str) -> tuple[str, str]:
    """Return both forms of a template that click chooses by a number.

    Not every gettext finds them under their own text: that of Python 3.11.2 does not.
    """
    return ngettext(singular, plural, 2), ngettext(singular, plural, 1)


def _found(template: str, message: str, name: str) -> str | None:
    """Return what stands in a message where its template has a name."""
    pattern = "".join(
        re.escape(text) + (f"(?P<{place}>.*)" if place == name else ".*" if place else "")
        for text, place, _, _ in _parsed(template)
    )
    found = re.fullmatch(pattern, message, re.DOTALL)
    return None if found is None else found[name]


def _parsed(template: str) -> list[tuple[str, str | None, str | None, str | None]]:
    from string import Formatter  # here, because a misspelt word needs none

    return list(Formatter().parse(template))


def _named(parameter: click.Parameter, context: click.Context | None = None) -> str:
    """Return how a parameter is called: the option, the argument, or the variable that gave it."""
    if context is not None and parameter.envvar is not None:
        source = context.get_parameter_source(str(parameter.name))
        if source is ParameterSource.ENVIRONMENT:
            return str(parameter.envvar)
    if isinstance(parameter, click.Option):
        return _long_name(parameter)
    return (parameter.metavar or str(parameter.name).upper()).strip("[].")


def _long_name(parameter: click.Parameter) -> str:
    return max(parameter.opts, key=len)


def _form(context: click.Context) -> str:
    """Return how the command is typed, with its arguments by name."""
    arguments = [one for one in context.command.params if isinstance(one, click.Argument)]
    words = [
        name if one.required else f"[{name}]"
        for one, name in ((one, _named(one)) for one in arguments)
    ]
    return " ".join([context.command_path, *words])


def _help(context: click.Context | None) -> str:
    path = "robolink" if context is None else context.command_path
    return tr("Help: {command} --help", command=path)


def _commands_like(typed: str, context: click.Context | None) -> list[str]:
    """Return full command lines that may have been meant."""
    if context is None or not isinstance(context.command, click.Group):
        return []
    group, path = context.command, context.command_path
    # robolink's groups accept more names than they list; a plug-in's may be plain click.
    names = getattr(group, "typed_names", group.list_commands)(context)
    elsewhere: list[str] = getattr(group, "groups_with", lambda *_: [])(context, typed)
    return elsewhere or [f"{path} {one}" for one in _alike(typed, names)]


def _alike(typed: str, names: Any) -> list[str]:  # noqa: ANN401 - any iterable of texts
    from difflib import get_close_matches  # here, because only misspelt words need it

    return get_close_matches(typed, list(names), n=2, cutoff=_NEAR)


def _meant(names: list[str]) -> list[str]:
    return [tr("Did you mean {names}?", names=", ".join(names))] if names else []


def _first_sentence(text: str) -> str:
    first, stop, _ = " ".join(text.split()).partition(". ")
    return first + "." * bool(stop)


def _ended(text: str) -> str:
    return text if text.endswith((".", "?", "!", ")", "\u3002")) else f"{text}."


def _quoted(value: str) -> str:
    return _cut(repr(value))


def _cut(text: str) -> str:
    """Return a text whose words fit on a line: nobody reads 300 letters."""
    return re.sub(
        r"\S{%d,}" % _LONGEST_VALUE,  # noqa: UP031 - braces are the pattern's
        lambda found: f"{found[0][:20]}...{found[0][-8:]}",
        text,
    )
