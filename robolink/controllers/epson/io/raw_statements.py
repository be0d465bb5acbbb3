"""A statement that a person typed: the one door past the typed builders.

Source: docs/reference/rules.md 8.
"""

from robolink.controllers.epson.link.answers import NOT_EXECUTED
from robolink.controllers.epson.link.link import EpsonLink
from robolink.controllers.epson.link.requests import command_class_of
from robolink.errors import ConfigError, ControllerFaultError, RejectedError
from robolink.messages import tr
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry, require_engineer
from robolink.protocols.epson_text import Refusal, Reply, Request
from robolink.protocols.spel import Statement
from robolink.stop_latch import CommandClass


class RawStatements:
    """Runs statements as they were typed, each marked before and on record after."""

    def __init__(self, link: EpsonLink) -> None:
        self._link = link

    def execute(self, text: str) -> str:
        """See :meth:`robolink.controllers.EpsonController.execute_raw`."""
        statement = _checked(text)
        with self._link.lock.held(statement):
            # Before an engineer's word for it goes on record.
            self._link.markers.require_settled(statement)
            self._link.window.require_ready(statement)
            if command_class_of(Request("Execute", (statement,))) is CommandClass.ACT:
                self._link.window.require_abort(statement)
            require_engineer(
                self._link.markers.outcomes, tr("run {statement!r} as typed", statement=statement)
            )
            with self._link.uninterrupted(), self._link.markers.ledger.block():
                marker = self._link.markers.begin(MarkerKind.SET, statement, {"raw": True})
                self._link.forget_robot()
                with self._link.markers.doubt(statement):
                    with self._link.markers.unless_stopped(marker):
                        answer = self._link.session.execute(statement)
                    self._check(statement, answer, marker)
                self._link.markers.ledger.proved(marker, None)
                printed = answer.text or "" if isinstance(answer, Reply) else ""
                self._link.markers.clear(
                    marker, _entry(marker, verdict=tr("carried out"), said=printed)
                )
        return printed

    def _check(self, statement: Statement, answer: Reply | Refusal, marker: Marker) -> None:
        """Raise unless it ran; a plain refusal settles the marker."""
        if isinstance(answer, Reply) and (answer.text is not None or answer.fields == ("0",)):
            return
        try:
            raise self._link.window.failure(statement, answer)
        except (RejectedError, ControllerFaultError) as error:
            if error.code in NOT_EXECUTED and isinstance(error, RejectedError):
                self._link.markers.clear(marker, _entry(marker, verdict=error.what))
            raise


def _checked(text: str) -> Statement:
    stripped = text.strip()
    if not stripped or not (stripped.isascii() and stripped.isprintable()):
        raise ConfigError(
            tr("{text!r} cannot be sent as a statement.", text=text),
            remedy=tr("Write one line of printable ASCII."),
        )
    return Statement(stripped)


def _entry(marker: Marker, *, verdict: str, said: str = "") -> NewEntry:
    return NewEntry(
        EntryKind.RAW,
        operation=marker.operation,
        verdict=verdict,
        details={"request": marker.request, "printed": said},
    )
