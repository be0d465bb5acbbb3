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
from robolink_cli._render import emit_json, json_is_on, note, say, switch_json_on

if TYPE_CHECKING:
    from robolink.controllers.epson import EpsonController
    from robolink.model import Marker

CommandT = TypeVar("CommandT", bound=Callable[..., Any])

_GIVEN = "robolink.given"


class CliContext(NamedTuple):
    """What a command was told from both sides of its name, and how it answers.

    Attributes:
        url: The controller's URL.
        password_file: File whose first line is the password.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out that is set in the controller; 0 for none.
    """

    url: str | None = None
    password_file: str | None = None
    timeout_s: float = 3.0
    remote_timeout_s: float = 60.0

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
                    "Give -c URL, for example -c epson+tcp://192.168.0.1:5000, or set "
                    "ROBOLINK_CONTROLLER."
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


def controller_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the same options to a command, and pass it a :class:`CliContext` first."""

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> None:
        given = click.get_current_context().meta.get(_GIVEN, {})
        command(CliContext(**given), *args, **kwargs)

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
def open_controller(context: CliContext, *, quiet: bool = False) -> "Iterator[EpsonController]":
    """Connect to the controller and, unless ``quiet``, say what was left unfinished there.

    Raises:
        ConfigError: No controller is named, or the URL or password file is wrong.
        ConnectError: It is not reached.
        LoginRefusedError: Wrong or missing password.
    """
    from robolink.transport import parse_url
    from robolink_cli._password import find_password

    url = context.require_url()
    password = find_password(parse_url(url).identity, password_file=context.password_file)
    with robolink.connect(
        url,
        password=password,
        timeout_s=context.timeout_s,
        remote_timeout_s=context.remote_timeout_s,
    ) as controller:
        found = controller.outcomes.open_markers()
        if not quiet:
            for marker in found:
                note(marker_notice(marker, url))
        try:
            yield controller
        finally:
            for marker in controller.outcomes.open_markers():
                if marker not in found:
                    note(marker_notice(marker, url))


def marker_notice(marker: "Marker", url: str) -> str:
    """Return what a person must know about an unsettled marker, and what settles it."""
    from robolink.model import MarkerKind

    if marker.kind is MarkerKind.SELECTION:
        return tr(
            "Not finished since {when}: {request}. Tool {now} is selected now; it was tool "
            "{tool} before.\n  'robolink -c {url} resolve' puts tool {tool} back.",
            when=marker.begun_at,
            request=marker.request,
            now=marker.details.get("now", "?"),
            tool=marker.details.get("tool", "?"),
            url=url,
        )
    return tr(
        "Sent {when} and never answered: {request}. It may or may not have run, so motion is "
        "blocked.\n  'robolink -c {url} resolve' settles it.",
        when=marker.begun_at,
        request=marker.request,
        url=url,
    )


def _link_options(command: CommandT) -> CommandT:
    options = (
        click.option(
            "-c",
            "--controller",
            "url",
            metavar="URL",
            envvar="ROBOLINK_CONTROLLER",
            show_envvar=True,
            expose_value=False,
            callback=_keep,
            help=tr("The controller, for example epson+tcp://192.168.0.1:5000."),
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
    )
    for option in reversed(options):
        command = option(command)
    return command


def _keep(context: click.Context, parameter: click.Parameter, value: object) -> None:
    given: dict[str, object] = context.meta.setdefault(_GIVEN, {})
    name = str(parameter.name)
    # The environment speaks at each level of the command line, and must not overrule what
    # was written at an earlier one.
    typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    if value is not None and (typed or name not in given):
        given[name] = value


def _note_json(context: click.Context, parameter: click.Parameter, value: bool) -> None:  # noqa: ARG001 - click's form
    if value:
        switch_json_on(context)
