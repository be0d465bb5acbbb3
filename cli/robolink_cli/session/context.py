"""What every command that talks to a controller has in common."""

import os
import shlex
from collections.abc import Callable, Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import click

from robolink.errors import ConfigError, NotReadyError
from robolink.messages import declared, spoken, tr
from robolink.model import Controller
from robolink_cli.access.capabilities import require_epson
from robolink_cli.access.cell import (
    is_cell_name,
    link_options,
    nothing_named,
    only_cell,
    which_cell,
)
from robolink_cli.console.person import Person, may_be_guided, person_here
from robolink_cli.console.render import json_is_on, log_wanted, note
from robolink_cli.options.declaration import add_declared, packed
from robolink_cli.options.shared import GIVEN, TYPED, all_shared
from robolink_cli.prompts.current_desk import current_desk
from robolink_cli.stopping.request import StopRequest

if TYPE_CHECKING:
    from robolink.backup import ToolState
    from robolink.config import Cell, Expected, Reach
    from robolink_cli.wizard.state import Header


class CliContext(NamedTuple):
    """What a command was told from both sides of its name, and how it answers.

    Attributes:
        url: The controller's URL.
        password_file: File whose first line is the password.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out that is set in the controller; 0 for none.
        wait_s: How long another program that has the controller is waited for.
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
    wait_s: float = 0.0
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

    def require_url(self) -> str:
        """Return the URL.

        Raises:
            ConfigError: None was given, and no only cell was taken.
        """
        if self.url is None:
            raise nothing_named()
        return self.url

    @property
    def expected(self) -> "Expected | None":
        """The cell file's requirements even for reading; ``None`` without a cell."""
        if self.cell is not None:
            return self.cell.expected
        return self.reach.expected if self.reach is not None else None


Command = Callable[..., int | None]
"""The function that click calls. Returns the exit code, ``None`` for 0."""


def stop_request() -> StopRequest:
    """Return the request of a command that must not depend on any file."""
    given = click.get_current_context().meta.get(GIVEN, {})
    log_file, log_level = log_wanted()
    return StopRequest(
        named=given.get("url") or "",
        json=json_is_on(),
        password_file=given.get("password_file") or "",
        timeout_s=given.get("timeout_s", 3.0),
        operator=given.get("operator") or "",
        record=given.get("record") or "",
        log_file=log_file,
        log_level=log_level,
    )


def controller_options(command: Command) -> Command:
    """Add the same options to a command, and pass it a :class:`CliContext` first.

    Where no cell is named, the only one is taken (:func:`_with_only_cell`). What the command
    returns becomes the exit code.
    """
    return _with_options(command, lambda options: _context_from(_with_only_cell(options)))


def optional_controller(command: Command) -> Command:
    """As :func:`controller_options`, for a command that can also run without a controller."""
    return _with_options(
        command, lambda _: _context_from(click.get_current_context().meta.get(GIVEN, {}))
    )


def calming_options(command: Command) -> Command:
    """As :func:`controller_options`, for a command that reads or stops.

    It is not kept from a person by a cell file: where that is wrong, the address is taken from
    it, or from the last connection, and what is wrong is said.
    """
    return _with_options(command, lambda options: _calming_context_from(_with_only_cell(options)))


def looking_options(command: Command) -> Command:
    """As :func:`calming_options`, for a command that only reads.

    Cell files that were right at the last connection, and are the same, are not checked anew.
    """
    return _with_options(command, lambda options: _looking_context_from(_with_only_cell(options)))


def _with_options(
    command: Command, context_of: Callable[[Mapping[str, object]], CliContext]
) -> Command:
    """Add a command's declared and shared options; pass it the context of what was given."""
    call = packed(command)

    @wraps(command)
    def with_context(*args: object, **kwargs: object) -> int | None:
        context = context_of(kwargs)
        _name_at_the_wire(context)
        return call(context, *args, **kwargs)

    framed: Command = add_declared(command, all_shared, with_context)
    return framed


_JOBS: Final = {
    "change": declared("Change needle"),
    "recalibrate": declared("Change needle"),
    "check": declared("Check the cell"),
    "jog": declared("Jog"),
    "learn": declared("Learn a station"),
    "next": declared("Change needle"),
    "recover": declared("Recover"),
    "release": declared("Release the stop"),
    "reset": declared("Reset"),
    "undo": declared("Undo a change"),
}
"""What commands are called in the first row; others by their name."""


def _name_at_the_wire(context: CliContext) -> None:
    """Show at the wire which cell and which job it is, before the first question."""
    desk = current_desk()
    if person_here() is Person.WIRE and desk is not None:
        name = click.get_current_context().info_name or ""
        desk.regard(header_of(context, spoken(_JOBS[name]) if name in _JOBS else name))


def context_of_cell(name: str, *, anew: bool = False) -> CliContext:
    """Return a command's context for another cell than the one that ``-c`` names.

    Args:
        name: A cell of the cell files, or a URL.
        anew: Whether the line was about another cell, so that of it only who works here, and where
            the dialogue is recorded, holds for this one.

    Raises:
        ConfigError: There is no such cell, or a cell file is wrong.
    """
    given = click.get_current_context().meta.get(GIVEN, {})
    if anew:
        given = {key: given[key] for key in ("operator", "record") if key in given}
    return _context_from({**given, "url": name})


def context_with(cell: "Cell") -> CliContext:
    """Return a command's context for a cell whose files were read already."""
    given = click.get_current_context().meta.get(GIVEN, {})
    return CliContext(**{**link_options(cell), **given, "url": cell.url, "cell": cell})


def _with_only_cell(options: Mapping[str, object]) -> Mapping[str, Any]:
    """Return the common options, with the only cell if none is named.

    The cell that is taken is said first. A command that may move or write takes none where
    nobody is asked before: off a terminal, and with ``--yes``.

    Args:
        options: The command's own.
    """
    given: Mapping[str, Any] = click.get_current_context().meta.get(GIVEN, {})
    changes = "yes" in options and not options.get("dry_run")
    if given.get("url") is not None or (changes and (options["yes"] or not may_be_guided())):
        return given
    name = only_cell()
    if not name:
        return given
    note(which_cell(name))
    return {**given, "url": name}


def _context_from(given: Mapping[str, Any]) -> CliContext:
    name = given.get("url")
    if name is None or not is_cell_name(name):
        return CliContext(**given)
    from robolink.config import find_cell, use_journals_of

    cell = find_cell(name)
    use_journals_of([cell], cell.settings.journal or "")
    return CliContext(**{**link_options(cell), **given, "url": cell.url, "cell": cell})


def _looking_context_from(given: Mapping[str, Any]) -> CliContext:
    name = given.get("url")
    if name is None or not is_cell_name(name):
        return _context_from(given)
    from robolink.config import glance_at_cell

    reach = glance_at_cell(name)
    if reach is None:
        return _calming_context_from(given)
    _use_journal(name, reach)
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
        _use_journal(name, reach)
        note(reach.doubt or error.what)
        return CliContext(**{**given, "url": reach.url, "doubt": error, "reach": reach})


def _use_journal(name: str, reach: "Reach") -> None:
    if reach.journal or reach.home:
        from robolink.journal import CellHome, name_journals
        from robolink.transport import parse_url

        address = parse_url(reach.url).address
        places = {address: reach.journal, "": reach.journal}
        name_journals(places, homes={address: CellHome(name, reach.home)}, afresh=True)


T = TypeVar("T")


def guided_if_alone(
    context: CliContext,
    do: Callable[[], T],
    *,
    job: str,
    alone: bool = True,
    following: Callable[[], T] | None = None,
    steps: int = 0,
) -> T:
    """Do the work of a command; as a wizard if a person is at the terminal.

    Args:
        context: What the command was told.
        do: The work.
        job: What it is called in the first row.
        alone: Whether it is a person who is asked, and not a simulator's stand-in for one.
        following: What begins for the next tool, with a choice; ``None`` where none can.
        steps: How many numbered steps it has, 0 for none.

    Raises:
        BaseException: Whatever ended the work.
    """
    if not alone or not may_be_guided():
        return do()
    from robolink_cli.wizard.host import guided

    head = header_of(context, job, steps=steps)
    return guided(head, do, report=_page, following=following)


def _page(change: str) -> tuple[str, ...]:
    from robolink_cli.access.change_page import page_of_change  # report and journal, not before

    return page_of_change(change)


def header_of(
    context: CliContext,
    job: str,
    *chosen: str,
    needle: str = "",
    anew: bool = False,
    steps: int = 0,
) -> "Header":
    """Return the first row of a command's screens.

    Args:
        context: What the command was told.
        job: What it is called.
        chosen: What was chosen from a list, as it would be typed behind the command.
        needle: Id of the needle that is mounted.
        anew: Whether the line that began the command was about another job.
        steps: How many numbered steps the job has, 0 for none.
    """
    from robolink_cli.wizard.state import Header

    url = context.url or ""
    name = context.cell.name if context.cell is not None else url.partition("?")[0]
    return Header(
        name,
        job,
        simulated="+sim://" in url,
        command=_typed_again(context, chosen, anew=anew),
        needle=needle,
        steps=steps,
    )


def _typed_again(context: CliContext, chosen: tuple[str, ...], *, anew: bool) -> str:
    """Return the command line that starts the same job, with the choices made meanwhile."""
    typed = () if anew else click.get_current_context().meta.get(TYPED, ())
    words = [*typed, *chosen]
    if anew and context.cell is None and context.url is not None:
        words = ["-c", context.url, *words]
    named = any(word in ("-c", "--controller") or word[:13] == "--controller=" for word in words)
    if context.cell is not None and not named:
        words = ["-c", context.cell.name, *words]
    words = ["robolink", *words]
    if os.name != "nt":
        return shlex.join(words)
    import subprocess

    # cmd.exe and PowerShell both accept double quotes; cmd.exe reads single ones as text.
    return subprocess.list2cmdline(words)


def find_tools(controller: Controller, *, published: bool) -> "ToolState":
    """Return all tools and the selected one.

    Args:
        controller: A connected controller.
        published: Whether to read what the companion program published, which is legal while
            production runs and for a client that may only monitor.

    Raises:
        NotReadyError: The controller cannot be asked now; says what may be done instead.
        ConfigError: The project publishes no tools.
    """
    from robolink.backup import ToolState, read_tools  # no look needs them

    if not published:
        try:
            return read_tools(controller)
        except NotReadyError as error:
            error.advise(
                tr("With the companion program in the project, you can use --published now.")
            )
            raise
    found = require_epson(controller, tr("published tools")).published_tools()
    if found is None:
        raise ConfigError(
            tr("The project in {url} publishes no tools.", url=controller.identity),
            remedy=tr(
                "Add the program that 'robolink expert spel export DIR' "
                "writes and call RobolinkPublish "
                "once; docs/monitor-only.md says how."
            ),
        )
    return ToolState(found.tools, found.selected)
