"""What every command that talks to a controller has in common."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

import robolink
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli._begun import Begun
from robolink_cli._cell import (
    is_cell_name,
    link_options,
    require_expected_robot,
)
from robolink_cli._notices import note_unsettled
from robolink_cli._people import signature_of
from robolink_cli._recording import recording
from robolink_cli._render import emit_json, json_is_on, note, say
from robolink_cli._shared_options import GIVEN, shared_options
from robolink_cli._shared_options import json_option as json_option
from robolink_cli._shared_options import origin_of as origin_of

if TYPE_CHECKING:
    from robolink.config import Cell
    from robolink.model import Controller, OutcomeLog, Secret

WATCHED = "robolink.watched"
"""Where a prompt finds the controller whose status it must read while a person thinks."""


class CliContext(NamedTuple):
    """What a command was told from both sides of its name, and how it answers.

    Attributes:
        url: The controller's URL.
        password_file: File whose first line is the password.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out that is set in the controller; 0 for none.
        cell: What the cell files say, when a cell was named instead of a URL.
        record: File to which the dialogue with the controller is appended.
        operator: Badge or name of the person.
        nozzle: Id of the nozzle or needle that is mounted.
        lot: Its lot.
        station: Name of the station where it is measured.
    """

    url: str | None = None
    password_file: str | None = None
    timeout_s: float = 3.0
    remote_timeout_s: float = 60.0
    cell: "Cell | None" = None
    record: str | None = None
    operator: str | None = None
    nozzle: str = ""
    lot: str = ""
    station: str = ""

    def with_nozzle(self, nozzle: str | None, lot: str | None) -> "CliContext":
        """Return the same with what is mounted, for the record."""
        return self._replace(nozzle=nozzle or "", lot=lot or "")

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


def controller_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Add the same options to a command, and pass it a :class:`CliContext` first.

    What the command returns becomes the exit code.
    """

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> int | None:
        given = click.get_current_context().meta.get(GIVEN, {})
        return command(_context_from(given), *args, **kwargs)

    return shared_options(with_context)


@contextmanager
def open_controller(
    context: CliContext,
    *,
    quiet: bool = False,
    any_robot: bool = False,
    changes: bool = False,
) -> "Iterator[Controller]":
    """Connect to the controller and, unless ``quiet``, say what was left unfinished there.

    Args:
        context: What the command was told.
        quiet: Whether the command itself deals with what was left unfinished.
        any_robot: Whether it goes on at once, without a look at the model that the cell file
            names, without a question, and without a journal if it must.
        changes: Whether it may change something, so that a badge is asked for where the cell
            names people.

    Raises:
        ConfigError: No controller is named, the URL or password file is wrong, or the robot is
            not the cell's.
        ConnectError: It is not reached.
        LoginRefusedError: Wrong or missing password.
    """
    url = context.require_url()
    named = context.cell.name if context.cell else url
    password = password_of(context)
    signature = replace(
        signature_of(context.operator, context.cell, changes=changes),
        nozzle=context.nozzle,
        lot=context.lot,
        station=context.station,
    )
    begun = Begun(time.time())
    with (
        begun.ending_in_words(),
        recording(context.record, url.partition("?")[0]) as trace,
        robolink.connect(
            url,
            password=password,
            timeout_s=context.timeout_s,
            remote_timeout_s=context.remote_timeout_s,
            trace=trace,
            signature=signature,
            outcomes=_journal_or_memory(url) if any_robot else None,
        ) as controller,
    ):
        begun.controller = controller
        click.get_current_context().meta[WATCHED] = controller
        found = controller.outcomes.open_markers()
        if not quiet:
            note_unsettled(controller, found, named)
        if context.cell and not any_robot:
            require_expected_robot(controller, context.cell)
        if found and not quiet and not any_robot:
            from robolink_cli._offering import offer_to_restore

            offer_to_restore(controller, found)
        try:
            with begun.looking_once_more(found):
                yield controller
        finally:
            left = controller.outcomes.open_markers()
            note_unsettled(controller, [m for m in left if m not in found], named)


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


def _context_from(given: Mapping[str, Any]) -> CliContext:
    name = given.get("url")
    if name is None or not is_cell_name(name):
        return CliContext(**given)
    from robolink.config import find_cell

    cell = find_cell(name)
    return CliContext(**{**link_options(cell), **given, "url": cell.url, "cell": cell})


def _journal_or_memory(url: str) -> "OutcomeLog | None":
    """Return ``None`` for the journal, or a log in memory where the journal is out of order."""
    from robolink.errors import JournalError
    from robolink.journal import default_location, may_exist, memory_journal, open_journal

    try:
        if may_exist(default_location()):
            open_journal()
    except JournalError as error:
        note(str(error))
        return memory_journal(url).log(url)
    return None
