"""Who has a controller, and ending that process because a person says so.

The robot comes first: it is stopped, and it is known to stand still, before the process is ended
that may be the only one connected to it (docs/stopping.md, "A program that does not respond").
"""

import time
from contextlib import nullcontext, suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Final, NamedTuple

from robolink.errors import (
    ConfigError,
    ConnectError,
    JournalError,
    LeaseHeldError,
    OutcomeUnknownError,
    RobolinkError,
    TransportBrokenError,
)
from robolink.journal import (
    LeaseHolder,
    default_location,
    describe_holder,
    may_exist,
    open_journal,
)
from robolink.messages import joined, listed, tr
from robolink.model import EntryKind, NewEntry
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.stopping import ControllerHolder, end_process, holders_of, may_be_ended
from robolink.timing import local_label
from robolink.transport import far_end_of, parse_url
from robolink_cli.console.person import person_here
from robolink_cli.console.render import json_is_on, note
from robolink_cli.prompts.questions import asked, require_yes
from robolink_cli.session.context import CliContext, stop_request
from robolink_cli.stopping.outcome import Telling
from robolink_cli.stopping.stop_first import StopOutcome, stop_first

if TYPE_CHECKING:
    from robolink_cli.stopping.request import StopRequest

_SHOWS_ITSELF_S: Final = 1.0
"""Time in s within which a process that has just logged in leaves its address."""

_FREED_S: Final = 5.0
"""Time in s within which a controller notices that its client has ended."""

_AGAIN_S: Final = 0.1


class HolderProcess(NamedTuple):
    """A process of this computer that has a controller.

    Attributes:
        process: Which one.
        sentence: Who that is, since when and for what.
    """

    process: LeaseHolder
    sentence: str


class EndedProcess(NamedTuple):
    """A process that was ended.

    Attributes:
        process: Which one.
        reason: Why, in the person's words.
        rest: How the robot was known to stand still, in words.
    """

    process: LeaseHolder
    reason: str
    rest: str

    def entry(self) -> NewEntry:
        """Return what is recorded about it."""
        holder = describe_holder(self.process)
        verdict = tr(
            "Ended the program of {holder}: {reason}. {rest}",
            holder=holder,
            reason=self.reason,
            rest=self.rest,
        )
        details = {"ended": asdict(self.process), "reason": self.reason, "rest": self.rest}
        return NewEntry(EntryKind.LEASE, verdict=verdict, details=details)


def holder_of(url: str, *, glance: bool = False) -> HolderProcess | None:
    """Return the process of this computer that has a controller, other than this one.

    The record names it, and else the address that each command leaves while it is connected.
    Nothing is connected for it.

    Args:
        url: The controller.
        glance: Whether a record that cannot be read counts as one that names nobody.

    Raises:
        JournalError: The record cannot be read.
    """
    if "+sim://" in url:
        return None  # a simulator inside of a process is nobody else's
    with suppress(JournalError) if glance else nullcontext():
        found = _on_record(url)
        if found is not None:
            return found
    return _at_address(url)


def name_holder(url: str, error: ConnectError) -> RobolinkError:
    """Return the error of a place that is taken, with who has it if that is known.

    Args:
        url: The controller.
        error: The error of the connection.
    """
    # A connection that was closed at once may have come before the first client's address did.
    at_once = isinstance(error.__cause__, TransportBrokenError)
    until = time.monotonic() + (_SHOWS_ITSELF_S if at_once else 0.0)
    while (found := holder_of(url, glance=True)) is None and time.monotonic() < until:
        time.sleep(_AGAIN_S)
    if found is None:
        return error
    return LeaseHeldError(
        found.sentence,
        remedy=tr(
            "Nothing was sent. Wait ({wait}). If it does not respond: look at the robot, then "
            "stop it and end that program: {end}.",
            wait=remedy_word(RemedyWord.WAIT),
            end=remedy_word(RemedyWord.END_HOLDER),
        ),
        controller=error.controller,
    )


def end_holder(context: CliContext, reason: str) -> EndedProcess | None:
    """Stop the robot, and end the process of this computer that has its controller.

    Args:
        context: What the command was told.
        reason: Why, in the person's words.

    Returns:
        ``None`` where no process of this computer has it: nothing was done.

    Raises:
        BusyError: The process cannot be ended from here.
        ConfigError: No reason was given.
        DeclinedError: The person said no; nothing was done.
        OutcomeUnknownError: Nothing shows that the robot stands still, or the process has other
            controllers, too: it was not ended. Or it was, and the stop that follows is not
            confirmed.
    """
    if not reason.strip():
        raise ConfigError(
            tr("--take-over needs a reason."), remedy=tr("For example: --take-over 'it hangs'")
        )
    url = context.require_url()
    found = holder_of(url)
    if found is None:
        return None
    _require_no_other(url, found)
    _agree(found)
    request = stop_request()._replace(named=context.cell.name if context.cell else url)
    stopped = _stopped(request)
    rest = tr("The controller showed that the robot stands still.")
    if stopped.error is not None:
        _require_seen_at_rest(stopped.error, found)
        rest = tr("A person pressed the emergency stop and saw that the robot stands still.")
    _require_no_other(url, found)  # it may have connected to one meanwhile
    end_process(found.process)
    note(tr("Ended: {holder}.", holder=describe_holder(found.process)))
    if stopped.error is not None:
        _require_stopped(request)
    return EndedProcess(found.process, reason, rest)


def _require_no_other(url: str, found: HolderProcess) -> None:
    """Refuse to end a process that has other controllers: nobody looked at their robots.

    Raises:
        OutcomeUnknownError: It has; names them.
    """
    here = far_end_of(url)
    others = sorted(
        {
            one.controller or min(one.keys)
            for one in holders_of(None, others=True)
            if one.pid == found.process.pid and not one.keys & here
        }
    )
    if others:
        raise OutcomeUnknownError(
            listed(
                tr(
                    "{holder} has other controllers too, and whether their robots stand still is "
                    "not known:",
                    holder=describe_holder(found.process),
                ),
                others,
            ),
            remedy=tr(
                "No process was ended. Type robolink stop for each of them and look at the robots, "
                "then end process {pid} yourself.",
                pid=found.process.pid,
            ),
        )


def _on_record(url: str) -> HolderProcess | None:
    if not may_exist(default_location()):
        return None
    seen = open_journal(read_only=True).lease_of(parse_url(url).address)
    if seen is None or not may_be_ended(seen.who()):
        return None
    return _holder(seen.who(), describe_holder(seen.who()), seen.taken_at, seen.purpose)


def _at_address(url: str) -> HolderProcess | None:
    for holder in holders_of(far_end_of(url)):
        process = _process(holder)
        if process is not None and may_be_ended(process):
            return _holder(process, describe_holder(process), holder.since, holder.who)
    return None


def _process(holder: ControllerHolder) -> LeaseHolder | None:
    try:
        return LeaseHolder(**holder.process)  # type: ignore[arg-type]
    except TypeError:
        return None  # another version's


def _holder(process: LeaseHolder, who: str, since: str, purpose: str) -> HolderProcess:
    sentence = tr(
        "{holder} has had this controller locked since {since}: {purpose}.",
        holder=who,
        since=local_label(since),
        purpose=purpose,
    )
    return HolderProcess(process, sentence)


def _agree(found: HolderProcess) -> None:
    """Ask on a terminal; off it the reason is the consent."""
    if json_is_on() or not person_here():
        note(found.sentence)
        return
    question = tr(
        "{who} Stop the robot and end that program? What it was doing is recovered next.",
        who=found.sentence,
    )
    require_yes(question)


def _stopped(request: "StopRequest") -> StopOutcome:
    outcome = stop_first(request)
    _tell(request, outcome)
    return outcome


def _tell(request: "StopRequest", outcome: StopOutcome) -> None:
    """Say how a stop ended, and leave its note.

    Raises:
        BaseException: What ended it, if that was no error of the stop.
    """
    if outcome.error is not None and not isinstance(outcome.error, RobolinkError):
        raise outcome.error
    telling = Telling(request, outcome)
    if outcome.error is None:
        note(telling.sentence())
    for remark in telling.remarks():
        note(remark)


def _require_seen_at_rest(error: BaseException, found: HolderProcess) -> None:
    """Let the person at the cell answer for what cannot be read from here.

    Only where nobody could be reached who would know it: a controller that answers, and does not
    show that the robot stands still, is believed.

    Raises:
        OutcomeUnknownError: Nobody has seen it at rest.
    """
    what = error.what if isinstance(error, RobolinkError) else str(error)
    if isinstance(error, ConnectError) and person_here() and not json_is_on():
        note(what)
        question = tr(
            "robolink cannot stop the robot from here: press the emergency stop. Is it pressed, "
            "and do you see that the robot stands still?"
        )
        if asked(question):
            return
    raise OutcomeUnknownError(
        joined(
            " ",
            (
                what,
                tr(
                    "Nothing shows that the robot stands still, so robolink did not end {holder}.",
                    holder=describe_holder(found.process),
                ),
            ),
        ),
        remedy=tr(
            "Press the emergency stop. Then run this at a terminal, where you can confirm that "
            "the robot stands still."
        ),
    ) from error


def _require_stopped(request: "StopRequest") -> None:
    """Stop the robot over the connection that is free by now.

    Raises:
        OutcomeUnknownError: It is not confirmed.
    """
    until = time.monotonic() + _FREED_S
    outcome = stop_first(request)
    while isinstance(outcome.error, ConnectError) and time.monotonic() < until:
        time.sleep(_AGAIN_S)
        outcome = stop_first(request)
    _tell(request, outcome)
    if outcome.error is not None:
        ended = tr("That program has ended, but the stop is not confirmed.")
        raise OutcomeUnknownError(
            joined(" ", (ended, str(outcome.error))),
            remedy=tr("Leave the emergency stop pressed. Next: robolink recover"),
        ) from outcome.error
