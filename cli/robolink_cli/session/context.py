"""What every command that talks to a controller has in common."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

import robolink
from robolink.errors import ConfigError, RobolinkError
from robolink.interrupts import EndedBy, ended_by
from robolink.messages import tr
from robolink.standing import UNTOUCHED, Standing, note_standing, standing_after
from robolink_cli.console.exit_codes import is_cut_off
from robolink_cli.console.render import emit_json, json_is_on, note, say
from robolink_cli.options.shared import GIVEN, shared_options
from robolink_cli.options.shared import json_option as json_option
from robolink_cli.options.shared import origin_of as origin_of
from robolink_cli.session.cell import (
    is_cell_name,
    link_options,
    require_expected_robot,
)
from robolink_cli.session.operator_identity import signature_of
from robolink_cli.session.recording import recording
from robolink_cli.session.warnings import note_at_work, note_unsettled
from robolink_cli.stopping.listening import listening_for_stop, remember_address
from robolink_cli.stopping.request import StopRequest

if TYPE_CHECKING:
    from robolink.config import Cell, Expected, Reach
    from robolink.model import Controller, Marker, Secret

WATCHED = "robolink.watched"
"""Where a prompt finds the controller whose status it must read while a person thinks."""

CELL = "robolink.cell"
"""Where it finds what the cell file says, ``None`` where no cell was named."""

REACHED = "robolink.reached"
"""Where it finds by which URL that controller was reached."""


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
        doubt: What is wrong with the cell files, when they were not needed so far.
        reach: How the cell is reached all the same.
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
    doubt: ConfigError | None = None
    reach: "Reach | None" = None

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

    @property
    def expected(self) -> "Expected | None":
        """What the cell file says that even a look has to heed; ``None`` without a cell."""
        if self.cell is not None:
            return self.cell.expected
        return self.reach.expected if self.reach is not None else None

    def note(self, text: str) -> None:
        """Show a remark beside the result, on stderr."""
        note(text)

    def emit(self, kind: str, payload: Mapping[str, object], show: Callable[[], None]) -> None:
        """Give the result; see :func:`emit`."""
        emit(kind, payload, show)

    def show_requests(self, requests: Sequence[str]) -> None:
        """Give the requests of a dry run; see :func:`show_requests`."""
        show_requests(requests)


def emit(kind: str, payload: Mapping[str, object], show: Callable[[], None]) -> None:
    """Give the result: the document ``robolink/KIND/1`` to a machine, else ``show()``."""
    if json_is_on():
        emit_json(f"robolink/{kind}/1", payload)
    else:
        show()


def show_requests(requests: Sequence[str]) -> None:
    """Give the requests that a dry run would have sent, as they stand on the wire."""
    emit("dry-run", {"requests": list(requests)}, lambda: say("\n".join(requests)))


def stop_request() -> StopRequest:
    """Return what a command that must not depend on any file was told."""
    given = click.get_current_context().meta.get(GIVEN, {})
    return StopRequest(
        named=given.get("url") or "",
        json=json_is_on(),
        password_file=given.get("password_file") or "",
        timeout_s=given.get("timeout_s", 3.0),
        operator=given.get("operator") or "",
        record=given.get("record") or "",
    )


def controller_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Add the same options to a command, and pass it a :class:`CliContext` first.

    What the command returns becomes the exit code.
    """

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> int | None:
        given = click.get_current_context().meta.get(GIVEN, {})
        return command(_context_from(given), *args, **kwargs)

    return shared_options(with_context)


def calming_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """As :func:`controller_options`, for a command that looks or calms.

    It is not kept from a person by a cell file: where that is wrong, the address is taken from
    it, or from the last connection, and what is wrong is said.
    """

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> int | None:
        given = click.get_current_context().meta.get(GIVEN, {})
        return command(_calming_context_from(given), *args, **kwargs)

    return shared_options(with_context)


def looking_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """As :func:`calming_options`, for a command that only looks.

    Cell files that were right at the last connection, and are the same, are not checked anew.
    """

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> int | None:
        given = click.get_current_context().meta.get(GIVEN, {})
        return command(_looking_context_from(given), *args, **kwargs)

    return shared_options(with_context)


@contextmanager
def open_controller(
    context: CliContext,
    *,
    quiet: bool = False,
    looks: bool = False,
    calms: bool = False,
    changes: bool = False,
) -> "Iterator[Controller]":
    """Connect to the controller and, unless ``quiet``, say what was left unfinished there.

    Args:
        context: What the command was told.
        quiet: Whether the command itself deals with what was left unfinished.
        looks: Whether it only looks, so that no file keeps it back: without a journal if it
            must, and whatever robot the cell file names.
        calms: Whether it calms, so that it goes on as one that looks, and asks nothing.
        changes: Whether it may change something, so that a badge is asked for where the cell
            names people.

    Raises:
        ConfigError: No controller is named, the URL or password file is wrong, or the robot is
            not the cell's.
        ConnectError: It is not reached.
        LoginRefusedError: Wrong or missing password.
        StoppedError: A stop came, at the end or before.
    """
    url = context.require_url()
    unhindered = looks or calms
    if context.doubt is not None and not unhindered:
        raise context.doubt
    password = password_of(context)
    signature = replace(
        signature_of(context.operator, context.expected, changes=changes),
        nozzle=context.nozzle,
        lot=context.lot,
        station=context.station,
    )
    with (
        _only_what_was_touched(always=changes),
        recording(context.record, url.partition("?")[0]) as trace,
        robolink.connect(
            url,
            password=password,
            timeout_s=context.timeout_s,
            remote_timeout_s=context.remote_timeout_s,
            trace=trace,
            signature=signature,
            glance=unhindered,
        ) as controller,
        nullcontext() if calms else controller.latch.ending(tr("The command")),
    ):
        click.get_current_context().meta.update(
            {WATCHED: controller, REACHED: url, CELL: context.expected}
        )
        remember_address(context)
        with (
            listening_for_stop(controller, context, looks=unhindered),
            _saying_what_is_left(controller, context, quiet=quiet, looks=looks, calms=calms),
        ):
            yield controller
    if not unhindered:
        # A stop that came while the connection was closed: nobody may take this for a success.
        with controller.ledger.telling():
            controller.latch.require_open(tr("The command"))


@contextmanager
def _saying_what_is_left(
    controller: "Controller", context: CliContext, *, quiet: bool, looks: bool, calms: bool
) -> Iterator[None]:
    """Say before the work what others left on the controller, and after it what this left.

    Raises:
        RobolinkError: The journal or the robot is not as the command needs it.
    """
    named = context.expected.cell if context.expected else context.require_url()
    lenient = looks or calms
    trouble = controller.outcomes.trouble
    if trouble is not None and not lenient:
        raise trouble
    found = _open_markers(controller, lenient=lenient)
    for remark in controller.outcomes.remarks:
        note(remark)
    beside = not quiet and note_at_work(controller.outcomes, named)
    if not (quiet or beside):
        note_unsettled(controller, found, named)
    if context.expected and not calms:
        _check_robot(controller, context.expected, looks=looks)
    if found and not (quiet or calms or beside):
        from robolink_cli.prompts.restore_offer import offer_to_restore

        offer_to_restore(controller, found)
    try:
        yield
    except KeyboardInterrupt:
        # The last line says which tool is selected: as it is now, not as it was once.
        with suppress(RobolinkError):
            controller.tools.selected()
        _record_for_nobody(controller)
        raise
    finally:
        left = _open_markers(controller, lenient=lenient)
        known = {marker.operation for marker in found}
        note_unsettled(controller, [m for m in left if m.operation not in known], named)
        if trouble is not None:
            # After the work: nothing that the journal has to say stands before it.
            note(f"{trouble.what} {_unrecorded()}")


def _record_for_nobody(controller: "Controller") -> None:
    """Put what stands on record where a command was ended because nobody reads it any more."""
    from robolink.model import EntryKind, NewEntry, describe_standing

    by, standing = ended_by(), controller.ledger.standing()
    if by not in (EndedBy.HUNG_UP, EndedBy.OUTPUT_CLOSED) or standing.untouched:
        return
    details = {"ended_by": str(by)}
    entry = NewEntry(EntryKind.DECISION, verdict=describe_standing(standing), details=details)
    with suppress(ConfigError):  # what cannot be recorded is said, and is no other end
        controller.outcomes.append(entry)


@contextmanager
def _only_what_was_touched(*, always: bool) -> Iterator[None]:
    """Let an error tell what stands on the controller, if the command might have changed it.

    Whoever ended a command is told in any case; but not that nobody reads what it only showed.
    """
    try:
        yield
    except BaseException as error:
        ended = isinstance(error, KeyboardInterrupt)
        if ended and standing_after(error) is UNTOUCHED:
            # It came before the controller was reached, or at the logout.
            watched = click.get_current_context().meta.get(WATCHED)
            note_standing(error, watched.ledger.standing() if watched else Standing())
        told = always or (ended and not is_cut_off(error))
        if not told and standing_after(error).untouched:
            note_standing(error, UNTOUCHED)
        raise


def password_of(context: CliContext) -> "Secret | None":
    """Find the controller's password in the places that may hold it.

    Raises:
        ConfigError: The password file is wrong.
    """
    from robolink.transport import parse_url
    from robolink_cli.session.password import find_password

    settings = context.cell.settings if context.cell else context.reach
    return find_password(
        parse_url(context.require_url()).identity,
        password_file=context.password_file,
        cell_file=settings.password_file if settings else None,
        cell_variable=settings.password_env if settings else None,
    )


def _check_robot(controller: "Controller", cell: "Expected", *, looks: bool) -> None:
    try:
        require_expected_robot(controller, cell)
    except ConfigError as error:
        if not looks:
            raise
        note(str(error))


def _context_from(given: Mapping[str, Any]) -> CliContext:
    name = given.get("url")
    if name is None or not is_cell_name(name):
        return CliContext(**given)
    from robolink.config import find_cell

    cell = find_cell(name)
    return CliContext(**{**link_options(cell), **given, "url": cell.url, "cell": cell})


def _looking_context_from(given: Mapping[str, Any]) -> CliContext:
    name = given.get("url")
    if name is None or not is_cell_name(name):
        return _context_from(given)
    from robolink.config import glance_at_cell

    reach = glance_at_cell(name)
    if reach is None:
        return _calming_context_from(given)
    said = {"timeout_s": reach.timeout_s} if reach.timeout_s else {}
    return CliContext(**{**said, **given, "url": reach.url, "reach": reach})


def _calming_context_from(given: Mapping[str, Any]) -> CliContext:
    try:
        return _context_from(given)
    except ConfigError as error:
        name = given.get("url")
        if name is None or not is_cell_name(name):
            raise
        from robolink.config import reach_cell

        try:
            reach = reach_cell(name)
        except ConfigError:
            raise error from None
        note(reach.doubt or error.what)
        return CliContext(**{**given, "url": reach.url, "doubt": error, "reach": reach})


def _unrecorded() -> str:
    return tr("So what is unfinished may not show, and nothing can be changed until it is mended.")


def _open_markers(controller: "Controller", *, lenient: bool) -> "tuple[Marker, ...]":
    """Return what is unsettled; a journal that broke meanwhile keeps nobody from looking."""
    from robolink.errors import JournalError

    try:
        return controller.outcomes.open_markers()
    except JournalError as error:
        if not lenient:
            raise
        note(error.what)
        return ()
