"""The faulty proxy for a CAN bus: two buses in memory and threads that carry between them."""

import threading
import time
from typing import Final, Self

import can

from tests.peers._faulty_proxy import LATE_S, Begins, Fault

_REQUESTS: Final = 0x600
_ANSWERS: Final = 0x580
_LOOK_S: Final = 0.05


class CanProxy:
    """Carries frames between the clients' bus and the node's; a context manager.

    The faults occur in the answers of the node's SDO server.

    Attributes:
        frames: SDO requests sent by a client since the fault was chosen.

    Args:
        near: Name of the clients' bus.
        far: Name of the node's bus.
        node: Its number.
    """

    def __init__(self, near: str, far: str, node: int) -> None:
        self.frames: list[bytes] = []
        self._near = can.Bus(interface="virtual", channel=near)
        self._far = can.Bus(interface="virtual", channel=far)
        self._node = node
        self._fault: Fault = ""
        self._waiting: tuple[Begins, Fault] | None = None
        self._late: list[tuple[float, can.Message]] = []
        self._ended = threading.Event()
        # One for each direction: a single thread would wait for one bus while the other has frames.
        self._threads = [
            threading.Thread(target=carry, name="faulty bus", daemon=True)
            for carry in (self._carry_requests, self._carry_answers)
        ]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        for thread in self._threads:
            thread.join(5)
        self._near.shutdown()
        self._far.shutdown()

    def arm(self, fault: Fault, begins: Begins = lambda _frame: True) -> None:
        """Choose the fault, from the first request on for which ``begins`` returns true."""
        self.frames.clear()
        self._waiting, self._fault = (begins, fault), ""

    def put(self, data: bytes) -> None:
        """Put an old answer of the node on the clients' bus (F03)."""
        self._near.send(_frame(_ANSWERS + self._node, data))

    def _carry_requests(self) -> None:
        while not self._ended.is_set():
            asked = self._near.recv(_LOOK_S)
            if asked is None:
                continue
            if asked.arbitration_id == _REQUESTS + self._node:
                self._requested(bytes(asked.data))
            if self._fault != "F11":
                self._far.send(_frame(asked.arbitration_id, bytes(asked.data)))

    def _carry_answers(self) -> None:
        while not self._ended.is_set():
            told = self._far.recv(0.001 if self._late else _LOOK_S)
            if told is not None:
                self._told(told)
            now = time.monotonic()
            due = [message for at, message in self._late if at <= now]
            self._late = [(at, message) for at, message in self._late if at > now]
            for message in due:
                self._near.send(_frame(message.arbitration_id, bytes(message.data)))

    def _requested(self, data: bytes) -> None:
        self.frames.append(data)
        if self._waiting is not None and self._waiting[0](data):
            self._fault, self._waiting = self._waiting[1], None

    def _told(self, message: can.Message) -> None:
        answer = message.arbitration_id == _ANSWERS + self._node
        if self._fault == "F11" or (self._fault == "F25" and answer):
            return
        if self._fault == "F01" and answer:
            self._late.append((time.monotonic() + LATE_S, message))
            self._fault = ""
            return
        self._near.send(_frame(message.arbitration_id, bytes(message.data)))


def _frame(identifier: int, data: bytes) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
