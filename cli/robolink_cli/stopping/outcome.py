"""What is shown, noted and read once the robot has stopped, or may not have."""

from contextlib import suppress

from robolink.errors import ConfigError, JournalError, LeaseHeldError, RobolinkError
from robolink.messages import in_english, listed, tr
from robolink.stopping import leave_note
from robolink.transport import parse_url
from robolink_cli.access.cell import which_cell
from robolink_cli.console.shell_words import state_word
from robolink_cli.stopping.request import StopRequest
from robolink_cli.stopping.stop_first import StopOutcome, is_beside_another, who_asks


class Telling:
    """Shows how a stop ended, then what was in its way without delaying it.

    Args:
        request: What was asked for.
        outcome: What became of it.
    """

    def __init__(self, request: StopRequest, outcome: StopOutcome) -> None:
        self._request = request
        self._outcome = outcome
        self._named = request.named or outcome.only
        _use_journal_of(self._named)

    def payload(self) -> dict[str, object]:
        """Return the document of a stop that ended well."""
        outcome = self._outcome
        return {
            "stopped": True,
            "controller": _shown(outcome.url),
            "state": outcome.state,
            "stopped_by": outcome.holder or None,
        }

    def sentence(self) -> str:
        """Return the sentence about a stop that ended well."""
        outcome = self._outcome
        named, state = _shown(outcome.url), state_word(outcome.state)
        if outcome.holder:
            return tr(
                "{controller}: the robot has stopped (confirmed). State: {state}. {holder} "
                "was working on it, and stopped it.",
                controller=named,
                state=state,
                holder=outcome.holder,
            )
        return tr(
            "{controller}: the robot has stopped (confirmed). State: {state}.",
            controller=named,
            state=state,
        )

    def remarks(self) -> list[str]:
        """Leave the note, read what was not read before, and return the remarks."""
        outcome = self._outcome
        told = [*outcome.doubts]
        taken = [which_cell(outcome.only)] if outcome.only else []
        if "write_unsecured=yes" in outcome.url and outcome.keys:
            from robolink.transport.opcua.security import protection_remark

            remark = protection_remark(parse_url(outcome.url))
            taken += [remark] if remark else []
        if outcome.may_stand and outcome.keys:
            told += self._noted()
        told += self._recorded()
        told += self._logged()
        told += self._journal()
        told += self._own_certificate()
        if told and outcome.error is None:
            told.append(tr("The stop went out anyway."))
        if outcome.error is None:
            told.append(
                tr(
                    "Commands with --yes are blocked until you run 'robolink robot reset' "
                    "or 'robolink robot release'."
                )
            )
        return [*taken, *told]

    def explain_the_holder(self) -> None:
        """Add to the error of a refused login who is logged in, as far as recorded."""
        error = self._outcome.error
        if not isinstance(error, RobolinkError) or not is_beside_another(error):
            return
        with suppress(RobolinkError):
            self._look_at_the_lease(error)

    def _look_at_the_lease(self, error: RobolinkError) -> None:
        from robolink import __version__
        from robolink.journal import default_location, may_exist, open_journal, signature_here

        address = parse_url(self._outcome.url).address
        if not may_exist(default_location(address)):
            return
        log = open_journal(address=address, read_only=True).log(
            address, signature=signature_here(__version__)
        )
        try:
            log.look()
            log.refuse_holder(silent=True)
        except LeaseHeldError as held:
            error.what = listed(error.what, [held.what])
            error.remedy = tr(
                "The stop is not confirmed: press the emergency stop, or stop at that computer."
            )

    def _noted(self) -> list[str]:
        outcome = self._outcome
        from robolink_cli.stopping.notes import last_known

        if "+sim://" in outcome.url:
            return []  # the simulator ends with this process, and nobody else moves it
        try:
            leave_note(
                outcome.keys,
                _shown(outcome.url),
                who_asks(self._request),
                confirmed=outcome.error is None,
                controller=outcome.controller,
                last_known="" if outcome.controller else last_known(outcome.url),
            )
        except OSError as error:
            return [
                tr(
                    "This stop could not be recorded ({cause}): the next command that "
                    "moves will not ask first.",
                    cause=error.strerror or error,
                )
            ]
        return []

    def _recorded(self) -> list[str]:
        if not self._request.record:
            return []
        from robolink_cli.access.record import recording

        try:
            with recording(self._request.record, _shown(self._outcome.url)) as trace:
                for at_ns, direction, data in self._outcome.heard:
                    if trace is not None:
                        trace(at_ns, direction, data)
        except RobolinkError as error:
            return [error.what]
        return []

    def _logged(self) -> list[str]:
        request, outcome = self._request, self._outcome
        if not (request.log_file or request.log_level):
            return []
        from robolink_cli.options.log_file import log_afterwards

        ended = in_english(str(outcome.error) if outcome.error else self.sentence())
        missed = log_afterwards(
            request.log_file, request.log_level, outcome.heard, ended, _shown(outcome.url)
        )
        return [missed] if missed else []

    def _journal(self) -> list[str]:
        """Return the journal's remarks: that it is damaged, or what was left unfinished."""
        from robolink.journal import default_location, may_exist, open_journal

        try:
            address = parse_url(self._outcome.url).address if self._outcome.keys else ""
            if not may_exist(default_location(address)):
                return []
            journal = open_journal(address=address, read_only=True)
            log = journal.log(address)
            open_now = log.open_markers()
        except JournalError as error:
            return [error.what]
        from robolink_cli.access.warnings import marker_notice, note_at_work

        if open_now and note_at_work(log, self._named):
            return []
        return [marker_notice(marker, self._named) for marker in open_now]

    def _own_certificate(self) -> list[str]:
        """Return that others can read this computer's key: a stop used it all the same."""
        url = self._outcome.url
        if "+opcua://" not in url or "security=none" in url:
            return []
        from robolink.transport.opcua.own_certificate import find_own_certificate

        try:
            find_own_certificate()
        except ConfigError as error:
            return [error.what]
        return []


def _use_journal_of(named: str) -> None:
    """Look for the journal where the cell files say, as far as they can be read."""
    from robolink.config import reach_cell
    from robolink.journal import name_journals
    from robolink_cli.access.cell import is_cell_name

    if named and is_cell_name(named):
        with suppress(RobolinkError):
            reach = reach_cell(named)
            places = {parse_url(reach.url).address: reach.journal, "": reach.journal}
            name_journals(places, afresh=True)


def _shown(url: str) -> str:
    return url.partition("?")[0]


def requests_of(request: StopRequest) -> tuple[str, ...]:
    """Return what a stop would send, as a dry run shows it; nothing is opened.

    Raises:
        ConfigError: No controller is named, or it is not known where it is.
    """
    from robolink.controllers import stop_requests
    from robolink_cli.stopping.notes import url_of

    return stop_requests(url_of(request))
