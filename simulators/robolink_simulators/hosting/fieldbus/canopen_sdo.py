"""The SDO server of a simulated PLC: canopen's, with the faults that a plan wants."""

import time
from collections.abc import Callable
from typing import Any, Final

from canopen import LocalNode
from canopen.sdo.server import SdoServer

from robolink_simulators.hosting.fieldbus.canopen_objects import RESPONSE_OBJECT
from robolink_simulators.softmotion.mailbox.words.exchange import ServedAccess

_REQUEST: Final = 0x600
_ANSWER: Final = 0x580


class PlcSdoServer(SdoServer):
    """Answers late or not at all when told so; may refresh an object during its upload.

    Args:
        node: Whose objects.
        real_seconds: Turns a simulated delay into a real one.
    """

    def __init__(self, node: LocalNode, *, real_seconds: Callable[[float], float]) -> None:
        number = node.id or 0
        _untyped(super()).__init__(_REQUEST + number, _ANSWER + number, node)
        self._buffer: bytearray | None = None
        self._fresh: Callable[[], bytes] | None = None
        self._real_seconds = real_seconds
        self._silent = False
        self._size = 0

    def refresh_from(self, fresh: Callable[[], bytes]) -> None:
        """Let the response change in the middle of its upload, as an unlatched stack would."""
        self._fresh = fresh

    def let_go(self, served: ServedAccess) -> None:
        """Answer the request under way as ``served`` says."""
        if served.delay_s:
            time.sleep(self._real_seconds(served.delay_s))
        self._silent = not served.answered

    def send_response(self, response: bytes) -> None:
        """Send an answer, unless this one is to be lost."""
        if not self._silent:
            _untyped(super()).send_response(response)
        self._silent = False

    def init_upload(self, request: Any) -> None:  # noqa: ANN401 - as canopen declares it
        """Begin an upload."""
        _untyped(super()).init_upload(request)
        self._size = len(self._buffer or b"")

    def segmented_upload(self, command: int) -> None:
        """Send a segment; half-way an unlatched object changes under the client's hands."""
        left = len(self._buffer or b"")
        if self._fresh is not None and self._index == RESPONSE_OBJECT and left < self._size // 2:
            self._buffer = bytearray(self._fresh()[-left:])
            self._size = 0
        _untyped(super()).segmented_upload(command)


def _untyped(server: object) -> Any:  # noqa: ANN401 - canopen declares no types here
    return server
