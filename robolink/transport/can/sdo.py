"""SDO transfers under one deadline, with every answer checked (CiA 301 7.2.4).

Ours, and not canopen's: that client gives each frame a time-out of its own, does not look whose
answer a download gets, and its streams send on when they are closed, or collected as garbage,
after a failure.
"""

import contextlib
from collections import deque
from collections.abc import Callable
from typing import Final, Protocol

from robolink.errors import (
    RejectedError,
    RemoteProtocolError,
    TransportError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.timing import Deadline

_FRAME_BYTES: Final = 8
_SEGMENT_BYTES: Final = 7
_EXPEDITED_BYTES: Final = 4
_MOST_BYTES: Final = 1024
"""Largest number of bytes of a transfer, larger than any block: a node that never ends one is cut
off."""

_SERVICE: Final = 0xE0
_DOWNLOAD_SEGMENT: Final = 0x00
_DOWNLOAD: Final = 0x20
_UPLOAD: Final = 0x40
_UPLOAD_SEGMENT: Final = 0x60
_ABORTED: Final = 0x80
_ANSWERS: Final = {_DOWNLOAD_SEGMENT: 0x20, _DOWNLOAD: 0x60, _UPLOAD: 0x40, _UPLOAD_SEGMENT: 0x00}
_TOGGLE: Final = 0x10
_EXPEDITED: Final = 0x02
_SIZED: Final = 0x01
_LAST: Final = 0x01

_ABORT_TIMED_OUT: Final = 0x0504_0000
_ABORT_UNKNOWN_SERVICE: Final = 0x0504_0001
_ABORT_HELD_BACK: Final = 0x0800_0020
"""Data cannot be transferred or stored to the application."""

_NO_SUCH_OBJECT: Final = (0x0602_0000, 0x0609_0011)
_LENGTH_DOES_NOT_FIT: Final = (0x0607_0010, 0x0607_0012, 0x0607_0013)


class SdoLine(Protocol):
    """What a transfer sends to and waits on."""

    answers: deque[bytes]
    """Answers of the node's SDO server, oldest first."""

    def ask(self, request: bytes) -> None:
        """Send a frame to the node's SDO server."""

    def pump(self, deadline: Deadline) -> None:
        """Pass on what arrives within a short slice of time; raise when the link has ended."""


class SdoTransfer:
    """One transfer of one object. Made anew for each; the caller has the lock.

    ``upload`` and ``download`` raise:
        RejectedError: The node aborted; a download was not done.
        TransportTimeoutError: No answer before the deadline.
        RemoteProtocolError: An answer that does not fit.
        TransportError: The bus failed or the line was closed.

    Args:
        line: Carries the frames.
        identity: Names the far end in errors.
        place: Index and subindex.
        deadline: For the whole of the transfer.
        strays: Answers to somebody else that are passed over. A client has one request under way
            at most, so one can still be due when a process was killed and the next one connects.
    """

    def __init__(
        self,
        line: SdoLine,
        identity: str,
        place: tuple[int, int],
        deadline: Deadline,
        *,
        strays: int = 0,
    ) -> None:
        self._line = line
        self._identity = identity
        self._index, self._subindex = place
        self._object = self._index.to_bytes(2, "little") + bytes([self._subindex])
        self._deadline = deadline
        self._strays = strays
        line.answers.clear()

    def upload(self) -> bytes:
        """Return what the object holds."""
        answer = self._exchange(bytes([_UPLOAD]) + self._object + bytes(_EXPEDITED_BYTES))
        if answer[0] & _EXPEDITED:
            unused = answer[0] >> 2 & 3 if answer[0] & _SIZED else 0
            return answer[4 : _FRAME_BYTES - unused]
        data = b""
        toggle = 0
        while len(data) <= _MOST_BYTES:
            answer = self._exchange(bytes([_UPLOAD_SEGMENT | toggle]) + bytes(_SEGMENT_BYTES))
            data += answer[1 : _FRAME_BYTES - (answer[0] >> 1 & 7)]
            if answer[0] & _LAST:
                return data
            toggle ^= _TOGGLE
        raise self._mismatched(answer)

    def download(self, data: bytes, admit: Callable[[], None] = lambda: None) -> None:
        """Write ``data`` to the object, once.

        Args:
            data: What to write.
            admit: Asked before the frame that makes it count. If it raises, that frame is not sent,
                and the server told to forget the others.
        """
        if len(data) <= _EXPEDITED_BYTES:
            unused = _EXPEDITED_BYTES - len(data)
            command = _DOWNLOAD | unused << 2 | _EXPEDITED | _SIZED
            admit()
            self._exchange(bytes([command]) + self._object + data + bytes(unused))
            return
        size = len(data).to_bytes(_EXPEDITED_BYTES, "little")
        self._exchange(bytes([_DOWNLOAD | _SIZED]) + self._object + size)
        toggle = 0
        for begin in range(0, len(data), _SEGMENT_BYTES):
            segment = data[begin : begin + _SEGMENT_BYTES]
            unused = _SEGMENT_BYTES - len(segment)
            last = _LAST if begin + _SEGMENT_BYTES >= len(data) else 0
            command = _DOWNLOAD_SEGMENT | toggle | unused << 1 | last
            if last:
                try:
                    admit()
                except BaseException:
                    self._abort(_ABORT_HELD_BACK)
                    raise
            self._exchange(bytes([command]) + segment + bytes(unused))
            toggle ^= _TOGGLE

    def _exchange(self, request: bytes) -> bytes:
        self._line.ask(request)
        while True:
            answer = self._next_answer()
            if self._fits(request, answer):
                return answer
            if answer[:4] == bytes([_ABORTED]) + self._object and len(answer) == _FRAME_BYTES:
                raise self._refused(int.from_bytes(answer[4:], "little"))
            if not self._strays:
                raise self._mismatched(answer)
            self._strays -= 1

    def _next_answer(self) -> bytes:
        while not self._line.answers:
            if self._deadline.expired:
                self._abort(_ABORT_TIMED_OUT)
                raise self._unanswered()
            self._line.pump(self._deadline)
        return self._line.answers.popleft()

    def _fits(self, request: bytes, answer: bytes) -> bool:
        service = request[0] & _SERVICE
        if len(answer) != _FRAME_BYTES or answer[0] & _SERVICE != _ANSWERS[service]:
            return False
        if service in (_DOWNLOAD_SEGMENT, _UPLOAD_SEGMENT):
            return answer[0] & _TOGGLE == request[0] & _TOGGLE
        return answer[1:4] == self._object

    def _abort(self, code: int) -> None:
        """Leave no server half-way; a bus that refuses even this reports it to the next one."""
        with contextlib.suppress(TransportError):
            self._line.ask(bytes([_ABORTED]) + self._object + code.to_bytes(4, "little"))

    @property
    def _shown(self) -> str:
        return tr("object {index:04X}h:{subindex}", index=self._index, subindex=self._subindex)

    def _unanswered(self) -> TransportTimeoutError:
        return TransportTimeoutError(
            tr(
                "{identity} did not answer: {request}.",
                identity=self._identity,
                request=self._shown,
            ),
            remedy=tr("Check the PLC, node number, bit rate and terminators, then connect again."),
            request=self._shown,
        )

    def _refused(self, code: int) -> RejectedError:
        from canopen.sdo.exceptions import SdoAbortedError  # for its table of names

        what = tr(
            "{identity} refused {object} with SDO abort {code:08X}h ({name}).",
            identity=self._identity,
            object=self._shown,
            code=code,
            name=SdoAbortedError.CODES.get(code, tr("not in the standard")),
        )
        if code in _NO_SUCH_OBJECT:
            remedy = tr("Load the mailbox's EDS into the PLC's CANopen device.")
        elif code in _LENGTH_DOES_NOT_FIT:
            remedy = tr("The PLC's mailbox has another version: compare its EDS.")
        else:
            remedy = tr("This request changed nothing. Look at the PLC's state.")
        return RejectedError(what, code=code, remedy=remedy, request=self._shown)

    def _mismatched(self, answer: bytes) -> RemoteProtocolError:
        self._abort(_ABORT_UNKNOWN_SERVICE)
        return RemoteProtocolError(
            tr(
                "{identity} answered something other than {object}.",
                identity=self._identity,
                object=self._shown,
            ),
            remedy=tr(
                "Look for a second SDO client, or a second node with this number, on the bus."
            ),
            request=self._shown,
            raw=answer,
        )
