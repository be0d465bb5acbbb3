"""How a PLC is asked to take over new values, and how it answers.

Commit bit: request on, the answer comes, request off, the answer goes. Level: the request
stays on until the answer comes. None: what is written counts. Each wait has its deadline.
"""

from contextlib import suppress
from typing import Final

from robolink.controllers.plc_map.places import Places
from robolink.errors import (
    BusyError,
    NotReadyError,
    NotReadyReason,
    OutcomeUnknownError,
    RejectedError,
    RobolinkError,
)
from robolink.messages import listed, tr
from robolink.register_maps import Commit, CommitKind, PlacedSignal, PlacedWord
from robolink.stop_latch import CommandClass
from robolink.timing import Deadline

_POLL_S: Final = 0.02


class Handshake:
    """The commit of one map."""

    def __init__(self, places: Places, commit: Commit[PlacedSignal, PlacedWord]) -> None:
        self._places = places
        self._commit = commit

    @property
    def answers(self) -> bool:
        """Whether the PLC reports that it has taken over the values."""
        return self._commit.kind is not CommitKind.NONE

    def make_ready(self) -> None:
        """Withdraw an old request, and refuse while the PLC cannot be asked.

        A request that stands was left by a client that died; nothing follows from ending it.

        Raises:
            BusyError: The PLC is busy, or its answer stands although nothing is asked.
            NotReadyError: It is in error already.
        """
        asked = self._commit.request
        if asked is not None and self._places.is_on(asked):
            self._places.switch(asked, on=False, kind=CommandClass.CALM)
        deadline = Deadline.after(self._places.clock, self._commit.timeout_s)
        while (hindrance := self._hindrance()) is not None:
            if deadline.expired:
                raise hindrance
            self._places.clock.sleep(_POLL_S)

    def wait_out(self) -> None:
        """Wait as long as an earlier request may be in progress, as far as the map says.

        Registers have no numbers and no owner: a value that arrives late cannot be told from one
        of now, and what arrives later than this nothing here can keep out (docs/plc-maps.md).
        """
        self._places.clock.sleep(self._commit.timeout_s)

    def carry_out(self, tool: int) -> None:
        """Have the PLC take over the values in the registers.

        Raises:
            RejectedError: It refused; the request is taken back.
            OutcomeUnknownError: It did not answer in time; the request is taken back.
        """
        commit, places = self._commit, self._places
        if commit.request is None:
            places.clock.sleep(commit.settle_s)
            return
        if commit.tool_number is not None:
            places.tell(commit.tool_number, tool)
        places.switch(commit.request, on=True)
        try:
            code = self._answered(commit.request)
        except RejectedError as error:  # of reading or resetting: the PLC may have acted
            raise self._unknown(error.what) from error
        if code is not None:
            raise RejectedError(
                tr("The PLC refused the new value: {error}.", error=self._error_in_words(code)),
                code=code,
                remedy=tr("The old value stays. Remove the cause, then try again."),
            )

    def requests(self, tool: int) -> tuple[str, ...]:
        """Return what :meth:`carry_out` writes, in words."""
        commit = self._commit
        if commit.request is None:
            return ()
        number = commit.tool_number
        named = (tr("write {place}: {value}", place=number.place, value=tool),) if number else ()
        return (
            *named,
            tr("switch {place} on", place=commit.request.place),
            tr("switch {place} off", place=commit.request.place),
        )

    def error_text(self, code: int) -> str:
        """Return the map's text for an error number, empty if it has none."""
        return self._commit.error_texts.get(code, "")

    def fault(self) -> int | None:
        """Return the number of the present error, 0 for one without a number."""
        commit = self._commit
        if commit.error is not None and not self._places.is_on(commit.error):
            return None
        if commit.error_code is None:
            return None if commit.error is None else 0
        code = self._places.word(commit.error_code)
        return code if code or commit.error is not None else None

    def is_busy(self) -> bool:
        """Whether the PLC reports that it is busy."""
        return self._places.is_on(self._commit.busy)

    def _answered(self, asked: PlacedSignal) -> int | None:
        """Wait for the answer and withdraw the request.

        Returns:
            The number of an error that came instead of the answer, ``None`` for none.
        """
        code = self._answer(asked)
        self._places.switch(asked, on=False, kind=CommandClass.CALM)
        if code is None and self._commit.kind is CommitKind.COMMIT_BIT:
            self._let_go()
        return code

    def _answer(self, asked: PlacedSignal) -> int | None:
        timeout_s = self._commit.timeout_s
        deadline = Deadline.after(self._places.clock, timeout_s)
        while True:
            code = self.fault()
            if code is not None or self._places.is_on(self._commit.answer):
                return code
            if deadline.expired:
                with suppress(RobolinkError):  # the error raised below applies in any case
                    self._places.switch(asked, on=False, kind=CommandClass.CALM)
                raise self._unknown(
                    tr(
                        "The PLC did not answer the request within {timeout:g} s.",
                        timeout=timeout_s,
                    )
                )
            self._places.clock.sleep(_POLL_S)

    def _let_go(self) -> None:
        """Wait until the answer has gone with the request."""
        timeout_s = self._commit.timeout_s
        deadline = Deadline.after(self._places.clock, timeout_s)
        while self._places.is_on(self._commit.answer):
            if deadline.expired:
                raise self._unknown(
                    tr("Its done signal is still on {timeout:g} s later.", timeout=timeout_s)
                )
            self._places.clock.sleep(_POLL_S)

    def _hindrance(self) -> RobolinkError | None:
        """Return why the PLC cannot be asked now."""
        places = self._places
        code = self.fault()
        if code is not None:
            return NotReadyError(
                tr("The PLC is in error: {error}.", error=self._error_in_words(code)),
                reason=NotReadyReason.FAULT,
                code=code,
                remedy=tr("Nothing was written. Clear it at the HMI."),
            )
        if self.is_busy() or places.is_on(self._commit.answer):
            return BusyError(
                tr("The PLC is busy with another request."),
                remedy=tr("Nothing was written. Wait until it has finished, then try again."),
            )
        return None

    def _error_in_words(self, code: int) -> str:
        if not code:
            return tr("error without a number")
        text = self.error_text(code)
        return (
            tr("error {code}, {text}", code=code, text=text)
            if text
            else tr("error {code}, which the map does not explain", code=code)
        )

    def _unknown(self, why: str) -> OutcomeUnknownError:
        return OutcomeUnknownError(
            listed(tr("robolink could not confirm that the PLC accepted the value:"), [why]),
            remedy=tr("The request was not repeated. Look at the HMI, then 'robolink recover'."),
        )
