"""The SDO server of a simulated PLC: canopen's, with the faults that a plan wants."""

import time
from collections.abc import Callable
from typing import Any, Final

from canopen import LocalNode
from canopen.sdo.server import SdoServer

from robolink_simulators.faults import PlcFault, PlcFaultAction
from robolink_simulators.hosting.fieldbus.canopen_objects import RESPONSE_OBJECT
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess

_REQUEST: Final = 0x600
_ANSWER: Final = 0x580
_SEGMENT_BYTES: Final = 7
_EXPEDITED_BYTES: Final = 4
_TOGGLE: Final = 0x10
_OF_ANOTHER_NODE: Final = bytes.fromhex("4b41600037020000")
"""An answer of a drive: its status word, 6041h."""


class PlcSdoServer(SdoServer):
    """Answers late or not at all when told so; may refresh an object during its upload.

    Args:
        node: Whose objects.
        real_seconds: Turns a simulated delay into a real one.
    """

    def __init__(self, node: LocalNode, *, real_seconds: Callable[[float], float]) -> None:
        number = node.id or 0
        self._asking_id, self._answering_id = _REQUEST + number, _ANSWER + number
        _untyped(super()).__init__(self._asking_id, self._answering_id, node)
        self._buffer: bytearray | None = None
        self._fresh: Callable[[], bytes] | None = None
        self._real_seconds = real_seconds
        self._silent = False
        self._size = 0
        self._met: tuple[PlcFault, ...] = ()
        self._asked = b""
        self._segments = 0
        self._segment = 0

    def on_request(self, can_id: int, data: bytearray, timestamp: float) -> None:
        """Serve a frame of the client."""
        self._asked = bytes(data)
        _untyped(super()).on_request(can_id, data, timestamp)

    def refresh_from(self, fresh: Callable[[], bytes]) -> None:
        """Let the response change in the middle of its upload, as an unlatched stack would."""
        self._fresh = fresh

    def let_go(self, served: ServedAccess) -> None:
        """Answer the request under way as ``served`` says."""
        if served.delay_s:
            time.sleep(self._real_seconds(served.delay_s))
        self._silent = not served.answered
        self._met = served.met
        size = 2 * len(served.words)
        self._segments = -(-size // _SEGMENT_BYTES) if size > _EXPEDITED_BYTES else 0
        self._segment = -1  # that of the answer that only announces them

    def send_response(self, response: bytes) -> None:
        """Send an answer, unless this one is to be lost; what a plan wants comes with it."""
        silent, self._silent = self._silent, False
        if silent:
            return
        for fault in (due := [fault for fault in self._met if self._is_due(fault)]):
            match fault.action:
                case PlcFaultAction.FOREIGN_NODE:
                    self._network.send_message(self._answering_id, _OF_ANOTHER_NODE)
                case PlcFaultAction.ECHO:
                    self._network.send_message(self._asking_id, self._asked)
                case PlcFaultAction.LOSE_SEGMENT:
                    silent = True
                case PlcFaultAction.WRONG_TOGGLE:
                    response = bytes([response[0] ^ _TOGGLE]) + bytes(response[1:])
        self._met = tuple(fault for fault in self._met if fault not in due)
        if not silent:
            _untyped(super()).send_response(response)

    @property
    def _network(self) -> Any:  # noqa: ANN401 - canopen declares no types here
        return _untyped(self).network

    def _is_due(self, fault: PlcFault) -> bool:
        """Tell whether a fault meets the frame that is about to leave."""
        if fault.action not in (PlcFaultAction.LOSE_SEGMENT, PlcFaultAction.WRONG_TOGGLE):
            return True
        if not self._segments:
            return True
        middle = self._segments // 2 if fault.position is None else fault.position
        return self._segment == middle % self._segments

    def init_upload(self, request: Any) -> None:  # noqa: ANN401 - as canopen declares it
        """Begin an upload."""
        _untyped(super()).init_upload(request)
        self._size = len(self._buffer or b"")

    def segmented_upload(self, command: int) -> None:
        """Send a segment; half-way an unlatched object changes under the client's hands."""
        self._segment += 1
        left = len(self._buffer or b"")
        if self._fresh is not None and self._index == RESPONSE_OBJECT and left < self._size // 2:
            self._buffer = bytearray(self._fresh()[-left:])
            self._size = 0
        _untyped(super()).segmented_upload(command)


def _untyped(server: object) -> Any:  # noqa: ANN401 - canopen declares no types here
    return server
