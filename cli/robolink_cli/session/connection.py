"""One controller for one command: connected, warnings shown, closed in order."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import click

import robolink
from robolink.controller_outcome import UNTOUCHED, ControllerOutcome, note_outcome, outcome_after
from robolink.errors import (
    ConfigError,
    ConnectError,
    ControllerError,
    JournalError,
    LoginUnansweredError,
    NotAtHomeError,
    OutcomeUnknownError,
    RobolinkError,
)
from robolink.interrupts import EndedBy, ended_by
from robolink.messages import joined, tr
from robolink_cli.access.cell import acceleration_of
from robolink_cli.access.record import recording
from robolink_cli.access.warnings import note_at_work, note_unsettled
from robolink_cli.console.exit_codes import is_cut_off
from robolink_cli.console.person import person_here
from robolink_cli.console.render import json_is_on, note
from robolink_cli.options.report import LINK_REMARK
from robolink_cli.prompts.questions import WATCHED, asked
from robolink_cli.session.context import CliContext
from robolink_cli.session.motion_consent import CELL, REACHED
from robolink_cli.session.movement_permits import asking_for_permits
from robolink_cli.session.operator_identity import signature_of
from robolink_cli.session.stop_listener import (
    listening_for_stop,
    remember_address,
    watched_at_desk,
)
from robolink_cli.stopping.stop_first import OPENED_ONCE

if TYPE_CHECKING:
    from robolink.config import Expected
    from robolink.model import ChangeLimits, Controller, Marker, Secret


LONGEST_CHECK_S: Final = 10.0
"""Longest time for which a check of cells has one of them, in s."""


@contextmanager
def open_controller(
    context: CliContext,
    *,
    quiet: bool = False,
    looks: bool = False,
    calms: bool = False,
    changes: bool = False,
    leaves: bool = False,
    usual_change_mm: float | None = None,
    job: str = "",
) -> "Iterator[Controller]":
    """Connect to the controller and, unless ``quiet``, show what was left unfinished there.

    Args:
        context: What the command was told.
        quiet: Whether the command itself deals with what was left unfinished.
        looks: Whether it only looks, so that no file keeps it back: without a journal if it
            must, and whatever robot the cell file names.
        calms: Whether it calms, so that it goes on as one that looks, and asks nothing.
        changes: Whether it may change something, so that a badge is asked for where the cell
            names people.
        leaves: Whether what it begins is settled by a later connection of the same command, so
            that nothing is said about it where all went well.
        usual_change_mm: How far a write may take a tip where the cell file does not say it; by
            default what is usual.
        job: What is to be done, where a person would look, measure or answer for it before
            anything is sent: refused at once while an earlier job is unfinished.

    Raises:
        ConfigError: No controller is named, the URL or password file is wrong, or the robot is
            not the cell's.
        ConnectError: It is not reached.
        LoginRefusedError: Wrong or missing password.
        NotAtHomeError: The home of the cell is another computer, and the command does not only
            look or calm; nothing was connected.
        OutcomeUnknownError: An earlier job is unfinished, and there is a ``job``.
        StoppedError: A stop came, at the end or before.
    """
    from robolink.journal import require_home
    from robolink.transport import parse_url

    url = context.require_url()
    unhindered = looks or calms
    if not unhindered:
        if context.doubt is not None:
            raise context.doubt
        require_home(parse_url(url).address)
    password = password_of(context)
    _let_a_check_end(url)
    signature = replace(
        signature_of(context.operator, context.expected, changes=changes),
        nozzle=context.nozzle,
        lot=context.lot,
        station=context.station,
    )
    with (
        _only_what_was_touched(always=changes),
        recording(context.record, url.partition("?")[0]) as trace,
        _naming_the_holder(
            url,
            lambda: robolink.connect(
                url,
                password=password,
                timeout_s=context.timeout_s,
                remote_timeout_s=context.remote_timeout_s,
                acceleration_mm_s2=acceleration_of(context.cell),
                wait_s=context.wait_s,
                trace=trace,
                signature=signature,
                limits=_limits_of(context, usual_change_mm),
                glance=unhindered,
                tell=note,
            ),
        ) as controller,
        controller.latch.ending(tr("The command")),
    ):
        click.get_current_context().meta.update(
            {WATCHED: controller, REACHED: url, CELL: context.expected}
        )
        remember_address(context)
        say_how_protected(url)
        with (
            watched_at_desk(controller),
            asking_for_permits(controller, url, context.cell),
            listening_for_stop(controller, context, looks=unhindered),
            _saying_what_is_left(
                controller, context, quiet=quiet, looks=looks, calms=calms, leaves=leaves
            ),
        ):
            if job:
                controller.require_settled(job)
            yield controller
    if not looks:
        # A stop came while the connection was closing: do not report success.
        with controller.ledger.telling():
            controller.latch.require_open(tr("The command"))


def say_how_protected(url: str, cell: str = "") -> None:
    """Say where a connection over OPC UA is less protected than it could be.

    Args:
        url: Of the controller.
        cell: Whose it is, where there are several.
    """
    if "+opcua://" not in url:
        return
    from robolink.transport import parse_url
    from robolink.transport.opcua.security import protection_remark

    with suppress(ConfigError):  # connecting reports what is wrong with the URL
        if remark := protection_remark(parse_url(url)):
            if not cell:
                click.get_current_context().meta[LINK_REMARK] = remark
            note(f"{cell}: {remark}" if cell else remark)


def _let_a_check_end(url: str) -> None:
    """Wait for a check that has this controller for a moment: an EPSON serves one client."""
    if "+sim://" in url:
        return
    from robolink.stopping import await_brief_holders
    from robolink.transport import far_end_of

    with suppress(RobolinkError):  # connecting reports what is wrong with the URL
        await_brief_holders(far_end_of(url), within_s=LONGEST_CHECK_S)


def _naming_the_holder(url: str, connect: "Callable[[], Controller]") -> "Controller":
    """Connect; if the only place is taken, say which process of this computer has it.

    Raises:
        LeaseHeldError: It is taken, and such a process is known.
        RobolinkError: As ``connect`` raises it.
    """
    try:
        return connect()
    except ConnectError as error:
        opened_once = any(medium in url for medium in OPENED_ONCE)
        if not opened_once and not isinstance(error, LoginUnansweredError):
            raise
        from robolink_cli.session.take_over import name_holder  # it is nearly always free

        named = name_holder(url, error)
        if named is error:
            raise
        raise named from error


def _limits_of(context: CliContext, usual_change_mm: float | None) -> "ChangeLimits | None":
    """Return how far a write may move a tip, by the cell file; a URL alone has no limits."""
    if context.cell is None:
        return None
    if usual_change_mm is None:
        return context.cell.limits()
    return context.cell.limits(usual_mm=usual_change_mm)


@contextmanager
def _saying_what_is_left(
    controller: "Controller",
    context: CliContext,
    *,
    quiet: bool,
    looks: bool,
    calms: bool,
    leaves: bool,
) -> Iterator[None]:
    """Show before the work what others left on the controller, and after it what this left.

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
        _offer_to_restore(controller, found)
    told = True
    try:
        yield
        told = not leaves
    except KeyboardInterrupt:
        # The last line shows the tool selected now, not the one selected before.
        with suppress(RobolinkError):
            controller.tools.selected()
        _record_for_nobody(controller)
        raise
    finally:
        left = _open_markers(controller, lenient=lenient)
        known = {marker.operation for marker in (found if told else left)}
        note_unsettled(controller, [m for m in left if m.operation not in known], named)
        if trouble is not None:
            # After the work, so that no message of the journal comes before the result.
            note(joined(" ", (trouble.what, _unrecorded(trouble))))


def _record_for_nobody(controller: "Controller") -> None:
    """Record what stands if a command ended because nobody reads its output any more."""
    from robolink.model import EntryKind, NewEntry, describe_outcome

    by, outcome = ended_by(), controller.ledger.outcome()
    if by not in (EndedBy.HUNG_UP, EndedBy.OUTPUT_CLOSED) or outcome.untouched:
        return
    details = {"ended_by": str(by)}
    entry = NewEntry(EntryKind.DECISION, verdict=describe_outcome(outcome), details=details)
    # A failure to record is reported, and does not change the exit code.
    with suppress(ConfigError, OutcomeUnknownError):
        controller.outcomes.append(entry)


@contextmanager
def _only_what_was_touched(*, always: bool) -> Iterator[None]:
    """Let an error report what stands, if the command might have changed the controller.

    Whoever ended a command is told in any case; but not that nobody reads what it only showed.
    """
    try:
        yield
    except BaseException as error:
        ended = isinstance(error, KeyboardInterrupt)
        if ended and outcome_after(error) is UNTOUCHED:
            # The stop came before the controller was reached, or at the logout.
            watched = click.get_current_context().meta.get(WATCHED)
            note_outcome(error, watched.ledger.outcome() if watched else ControllerOutcome())
        told = always or (ended and not is_cut_off(error))
        if not told and outcome_after(error).untouched:
            note_outcome(error, UNTOUCHED)
        raise


def password_of(context: CliContext) -> "Secret | None":
    """Find the controller's password in the places that may hold it.

    Raises:
        ConfigError: The password file is wrong.
    """
    from robolink.config.passwords import find_password
    from robolink.transport import parse_url

    settings = context.cell.settings if context.cell else context.reach
    return find_password(
        parse_url(context.require_url()).identity,
        password_file=context.password_file,
        cell_file=settings.password_file if settings else None,
        cell_variable=settings.password_env if settings else None,
    )


def _check_robot(controller: "Controller", cell: "Expected", *, looks: bool) -> None:
    from robolink.config import require_expected_robot

    try:
        require_expected_robot(controller, cell)
    except ConfigError as error:
        if not looks:
            raise
        note(str(error))


def _unrecorded(trouble: ConfigError) -> str:
    if isinstance(trouble, NotAtHomeError):
        return tr("Its journal is there: unfinished jobs may be missing here.")
    return tr(
        "Unfinished jobs may be missing here, and robolink changes nothing until the "
        "journal is repaired."
    )


def _open_markers(controller: "Controller", *, lenient: bool) -> "tuple[Marker, ...]":
    """Return the unfinished jobs; a journal that broke meanwhile does not prevent reading."""
    try:
        return controller.outcomes.open_markers()
    except JournalError as error:
        if not lenient:
            raise
        note(error.what)
        return ()


def _offer_to_restore(controller: "Controller", markers: "Iterable[Marker]") -> None:
    """Ask whether to restore the tool of an unfinished procedure.

    That comes before anything else is done. A no changes nothing and the command goes on. Nothing
    is asked of a script, nor where the controller is not in a state to be told anything.
    """
    if json_is_on() or not person_here():
        return
    from robolink.model import MarkerKind

    for marker in markers:
        if marker.kind is not MarkerKind.SELECTION:
            continue
        with suppress(ControllerError):
            finding = controller.resolver.examine(marker)
            if finding.action and asked(tr("{action}. Do this now?", action=finding.action)):
                controller.resolver.settle(finding)
                note(tr("Done, and read back."))
