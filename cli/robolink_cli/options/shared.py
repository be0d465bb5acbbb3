"""The options that stand before or after a command's name."""

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click
from click.core import ParameterSource

from robolink.locale.languages import ENGLISH, LANGUAGES, language_named
from robolink.messages import declared, tr
from robolink_cli.access.cell import complete_cell
from robolink_cli.console.language import OPTION, VARIABLE
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.output import visible
from robolink_cli.console.render import LOG_LEVELS, switch_json_on, want_log

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


if TYPE_CHECKING:
    _ParamType = click.ParamType[str]
else:
    _ParamType = click.ParamType  # click 8.1 knows no parameter of it

LONGEST: Final = 200
"""Longest text in characters, as in recipes."""


class LineType(_ParamType):
    """One line without control characters, refused in the words of recipes."""

    name = "text"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """Return the text.

        Raises:
            BadParameter: It holds a control character or a line break, or is too long.
        """
        text = str(value)
        if visible(text) != text or "\n" in text:
            self.fail(tr("it must not contain control characters or line breaks"), param, ctx)
        if len(text) > LONGEST:
            self.fail(tr("it has more than {most} characters", most=LONGEST), param, ctx)
        return text


LINE: Final = LineType()


CommandT = TypeVar("CommandT", bound=Callable[..., Any])

_CELL_OR_URL = "CELL|URL"

GIVEN = "robolink.given"
"""Key under which the options of all levels are collected."""

TYPED = "robolink.typed"
"""Key under which the command line is stored as typed."""

_ORIGINS = "robolink.origins"


def shared_options(command: CommandT) -> CommandT:
    """Add the options that are accepted before and after a command's name.

    What is given later, nearer to the command, wins. What the signature of the command declares is
    added too.
    """
    from robolink_cli.options.declaration import add_declared

    shared: CommandT = add_declared(command, all_shared)
    return shared


def all_shared(command: CommandT) -> CommandT:
    """Add the shared options alone."""
    return _json_and_language(_link_options(command))


class _Language(click.ParamType[str]):
    """A language by any of its names; environment variables are never refused."""

    name = "language"

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the language, English if a variable names one that robolink lacks."""
        found = language_named(value)
        if found is None and value != os.environ.get(VARIABLE):
            self.fail(
                tr("{value!r} is not a language of robolink: zh or en.", value=value), param, ctx
            )
        return found or ENGLISH

    def shell_complete(
        self,
        ctx: click.Context,  # noqa: ARG002 - click's form
        param: click.Parameter,  # noqa: ARG002 - click's form
        incomplete: str,
    ) -> "list[CompletionItem]":
        """Offer the languages for TAB."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(one) for one in LANGUAGES if one.startswith(incomplete)]


def json_option(command: CommandT) -> CommandT:
    """Add ``--json`` and ``--lang``, and what a command declares that needs no controller."""
    from robolink_cli.options.declaration import add_declared

    alone: CommandT = add_declared(command, _json_and_language)
    return alone


def _json_and_language(command: CommandT) -> CommandT:
    shared = _log_options(lang_option(command))
    return click.option(
        "--json",
        "json_",
        is_flag=True,
        expose_value=False,
        callback=_note_json,
        help=declared("Print one JSON document on stdout; text goes to stderr."),
    )(shared)


def _log_options(command: CommandT) -> CommandT:
    """Add ``--log-file`` and ``--log-level``."""
    file = click.option(
        "--log-file",
        type=click.Path(),
        metavar="FILE",
        expose_value=False,
        callback=_keep_log,
        help=declared("Append to FILE what is decided, and with --log-level debug what is sent."),
    )
    level = click.option(
        "--log-level",
        metavar="|".join(LOG_LEVELS),
        shell_complete=_complete_level,
        expose_value=False,
        callback=_keep_log,
        help=declared("How much --log-file holds (info)."),
    )
    return file(level(command))


def _keep_log(context: click.Context, parameter: click.Parameter, value: str | None) -> None:
    if value is not None:
        want_log(context, str(parameter.name), value)


def _complete_level(
    ctx: click.Context,  # noqa: ARG001 - click's form
    param: click.Parameter,  # noqa: ARG001 - click's form
    incomplete: str,
) -> "list[CompletionItem]":
    from click.shell_completion import CompletionItem

    return [CompletionItem(one) for one in LOG_LEVELS if one.startswith(incomplete)]


def lang_option(command: CommandT) -> CommandT:
    """Add ``--lang``. The language was found before click read the line."""
    return click.option(
        OPTION,
        type=_Language(),
        metavar="|".join(LANGUAGES),
        envvar=VARIABLE,
        show_envvar=True,
        expose_value=False,
        help=declared("Language of the sentences; what --json prints is always English."),
    )(command)


def controller_argument(command: CommandT) -> CommandT:
    """Let a command also take the controller as its argument: the same as ``-c``."""
    return click.argument(
        "named",
        metavar=f"[{_CELL_OR_URL}]",
        required=False,
        expose_value=False,
        callback=_keep_named,
        shell_complete=complete_cell,
    )(command)


def origin_of(option: str) -> str | None:
    """Return the option or variable by which a person gave ``option``, None without one."""
    origins: dict[str, str] = click.get_current_context().meta.get(_ORIGINS, {})
    return origins.get(option)


def _link_options(command: CommandT) -> CommandT:
    options = (
        click.option(
            "-c",
            "--controller",
            "url",
            metavar=_CELL_OR_URL,
            envvar="ROBOLINK_CONTROLLER",
            show_envvar=True,
            expose_value=False,
            callback=_keep,
            shell_complete=complete_cell,
            help=declared("A cell of the cell files, or a URL like epson+tcp://192.168.0.1:5000."),
        ),
        click.option(
            "--password-file",
            type=click.Path(dir_okay=False),
            metavar="FILE",
            expose_value=False,
            callback=_keep,
            help=declared(
                "File whose first line is the controller's password; readable by you only."
            ),
        ),
        click.option(
            "--timeout",
            "timeout_s",
            metavar="S",
            type=NumberInside(min=0, min_open=True),
            expose_value=False,
            callback=_keep,
            help=declared("Longest wait for one answer, in seconds (3)."),
        ),
        click.option(
            "--remote-timeout",
            "remote_timeout_s",
            metavar="S",
            type=NumberInside(min=0),
            expose_value=False,
            callback=_keep,
            help=declared(
                "The remote time-out set in the controller, in seconds (60); 0 forbids motion."
            ),
        ),
        click.option(
            "--wait",
            "wait_s",
            metavar="SECONDS",
            type=NumberInside(min=0),
            expose_value=False,
            callback=_keep,
            help=declared(
                "How long to wait for another program that has the controller (0); a stop does "
                "not wait."
            ),
        ),
        click.option(
            "--operator",
            metavar="ID",
            type=LINE,
            envvar="ROBOLINK_OPERATOR",
            show_envvar=True,
            expose_value=False,
            callback=_keep,
            help=declared("Your badge or name, for the record and the role."),
        ),
        click.option(
            "--record",
            metavar="FILE",
            type=click.Path(dir_okay=False),
            expose_value=False,
            callback=_keep,
            help=declared("Append the dialogue with the controller to FILE, without the password."),
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def _keep(context: click.Context, parameter: click.Parameter, value: object) -> None:
    given: dict[str, object] = context.meta.setdefault(GIVEN, {})
    name = str(parameter.name)
    # The environment applies at each level of the command line, and must not override what
    # was written at an earlier one.
    typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    if value is not None and (typed or name not in given):
        origin = parameter.opts[-1] if typed else str(parameter.envvar)
        _require_one_controller(context, origin, value)
        given[name] = value
        context.meta.setdefault(_ORIGINS, {})[name] = origin


def _keep_named(context: click.Context, parameter: click.Parameter, value: str | None) -> None:  # noqa: ARG001 - click's form
    if value is not None:
        _require_one_controller(context, _CELL_OR_URL, value)
        context.meta.setdefault(GIVEN, {})["url"] = value
        context.meta.setdefault(_ORIGINS, {})["url"] = _CELL_OR_URL


def _require_one_controller(context: click.Context, origin: str, value: object) -> None:
    """Refuse two controller names on the command line, in any order."""
    named = {origin, context.meta.get(_ORIGINS, {}).get("url")}
    if named == {"--controller", _CELL_OR_URL} and context.meta[GIVEN]["url"] != value:
        raise click.UsageError(
            tr("Two controllers are named; name one of them, with -c or after the command.")
        )


def _note_json(context: click.Context, parameter: click.Parameter, value: bool) -> None:  # noqa: ARG001 - click's form
    if value:
        switch_json_on(context)
