"""What every command that talks to a controller has in common."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import click
from click.core import ParameterSource

import robolink
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli._cell import (
    complete_cell,
    is_cell_name,
    link_options,
    require_expected_robot,
)
from robolink_cli._notices import marker_notice
from robolink_cli._recording import recording
from robolink_cli._render import emit_json, json_is_on, note, say, switch_json_on

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.controllers.epson import EpsonController
    from robolink.model import Secret

CommandT = TypeVar("CommandT", bound=Callable[..., Any])

_GIVEN = "robolink.given"

WATCHED = "robolink.watched"
"""Where a prompt finds the controller whose status it must read while a person thinks."""
_ORIGINS = "robolink.origins"


class CliContext(NamedTuple):
    """What a command was told from both sides of its name, and how it answers.

    Attributes:
        url: The controller's URL.
        password_file: File whose first line is the password.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out that is set in the controller; 0 for none.
        cell: What the cell files say, when a cell was named instead of a URL.
        record: File to which the dialogue with the controller is appended.
    """

    url: str | None = None
    password_file: str | None = None
    timeout_s: float = 3.0
    remote_timeout_s: float = 60.0
    cell: "Cell | None" = None
    record: str | None = None

    @property
    def json(self) -> bool:
        """Whether the result goes to stdout as one JSON document."""
        return json_is_on()

    def require_url(self) -> str:
        """Return the URL.

        Raises:
            ConfigError: None was given.
        """
        if self.url is None:
            raise ConfigError(
                tr("No controller is named."),
                remedy=tr(
                    "Give -c CELL from a cell file, or -c URL, for example "
                    "-c epson+tcp://192.168.0.1:5000, or set ROBOLINK_CONTROLLER."
                ),
            )
        return self.url

    def note(self, text: str) -> None:
        """Show a remark beside the result, on stderr."""
        note(text)

    def emit(self, kind: str, payload: Mapping[str, object], show: Callable[[], None]) -> None:
        """Give the result: the document ``robolink/KIND/1`` to a machine, else ``show()``."""
        if self.json:
            emit_json(f"robolink/{kind}/1", payload)
        else:
            show()

    def show_requests(self, requests: Sequence[str]) -> None:
        """Give the requests that a dry run would have sent, as they stand on the wire."""
        self.emit("dry-run", {"requests": list(requests)}, lambda: say("\n".join(requests)))


def shared_options(command: CommandT) -> CommandT:
    """Add the options that are accepted before and after a command's name.

    For groups. What is given later, nearer to the command, wins.
    """
    return json_option(_link_options(command))


def controller_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Add the same options to a command, and pass it a :class:`CliContext` first.

    What the command returns becomes the exit code.
    """

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> int | None:
        given = click.get_current_context().meta.get(_GIVEN, {})
        return command(_context_from(given), *args, **kwargs)

    return shared_options(with_context)


def json_option(command: CommandT) -> CommandT:
    """Add ``--json`` alone, for a command that needs no controller."""
    return click.option(
        "--json",
        "json_",
        is_flag=True,
        expose_value=False,
        callback=_note_json,
        help=tr("Print one JSON document on stdout; text goes to stderr."),
    )(command)


@contextmanager
def open_controller(
    context: CliContext, *, quiet: bool = False, any_robot: bool = False
) -> "Iterator[EpsonController]":
    """Connect to the controller and, unless ``quiet``, say what was left unfinished there.

    Args:
        context: What the command was told.
        quiet: Whether the command itself deals with what was left unfinished.
        any_robot: Whether it goes on at once, without a look at the model that the cell file
            names and without a question.

    Raises:
        ConfigError: No controller is named, the URL or password file is wrong, or the robot is
            not the cell's.
        ConnectError: It is not reached.
        LoginRefusedError: Wrong or missing password.
    """
    url = context.require_url()
    named = context.cell.name if context.cell else url
    password = password_of(context)
    with (
        recording(context.record, url.partition("?")[0]) as trace,
        robolink.connect(
            url,
            password=password,
            timeout_s=context.timeout_s,
            remote_timeout_s=context.remote_timeout_s,
            trace=trace,
        ) as controller,
    ):
        click.get_current_context().meta[WATCHED] = controller
        found = controller.outcomes.open_markers()
        if not quiet:
            for marker in found:
                note(marker_notice(marker, named))
        if context.cell and not any_robot:
            require_expected_robot(controller, context.cell)
        if found and not quiet and not any_robot:
            from robolink_cli._offering import offer_to_restore

            offer_to_restore(controller, found)
        try:
            yield controller
        finally:
            for marker in controller.outcomes.open_markers():
                if marker not in found:
                    note(marker_notice(marker, named))


def password_of(context: CliContext) -> "Secret | None":
    """Find the controller's password in the places that may hold it.

    Raises:
        ConfigError: The password file is wrong.
    """
    from robolink.transport import parse_url
    from robolink_cli._password import find_password

    settings = context.cell.settings if context.cell else None
    return find_password(
        parse_url(context.require_url()).identity,
        password_file=context.password_file,
        cell_file=settings.password_file if settings else None,
        cell_variable=settings.password_env if settings else None,
    )


def origin_of(option: str) -> str | None:
    """Return the option or variable by which a person gave ``option``, None when nobody did."""
    origins: dict[str, str] = click.get_current_context().meta.get(_ORIGINS, {})
    return origins.get(option)


def _link_options(command: CommandT) -> CommandT:
    options = (
        click.option(
            "-c",
            "--controller",
            "url",
            metavar="CELL|URL",
            envvar="ROBOLINK_CONTROLLER",
            show_envvar=True,
            expose_value=False,
            callback=_keep,
            shell_complete=complete_cell,
            help=tr("A cell of the cell files, or a URL like epson+tcp://192.168.0.1:5000."),
        ),
        click.option(
            "--password-file",
            type=click.Path(dir_okay=False),
            expose_value=False,
            callback=_keep,
            help=tr("File whose first line is the controller's password; readable by you only."),
        ),
        click.option(
            "--timeout",
            "timeout_s",
            metavar="S",
            type=click.FloatRange(min=0, min_open=True),
            expose_value=False,
            callback=_keep,
            help=tr("Longest wait for one answer, in seconds (3)."),
        ),
        click.option(
            "--remote-timeout",
            "remote_timeout_s",
            metavar="S",
            type=click.FloatRange(min=0),
            expose_value=False,
            callback=_keep,
            help=tr(
                "The remote time-out set in the controller, in seconds (60); 0 forbids motion."
            ),
        ),
        click.option(
            "--record",
            metavar="FILE",
            type=click.Path(dir_okay=False),
            expose_value=False,
            callback=_keep,
            help=tr("Append the dialogue with the controller to FILE, without the password."),
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def _context_from(given: Mapping[str, Any]) -> CliContext:
    name = given.get("url")
    if name is None or not is_cell_name(name):
        return CliContext(**given)
    from robolink.config import find_cell

    cell = find_cell(name)
    return CliContext(**{**link_options(cell), **given, "url": cell.url, "cell": cell})


def _keep(context: click.Context, parameter: click.Parameter, value: object) -> None:
    given: dict[str, object] = context.meta.setdefault(_GIVEN, {})
    name = str(parameter.name)
    # The environment speaks at each level of the command line, and must not overrule what
    # was written at an earlier one.
    typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    if value is not None and (typed or name not in given):
        given[name] = value
        origin = parameter.opts[-1] if typed else str(parameter.envvar)
        context.meta.setdefault(_ORIGINS, {})[name] = origin


def _note_json(context: click.Context, parameter: click.Parameter, value: bool) -> None:  # noqa: ARG001 - click's form
    if value:
        switch_json_on(context)
