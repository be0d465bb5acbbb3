"""The object dictionary of a simulated PLC on CANopen (docs/reference/mailbox.md, "CANopen")."""

import io
import struct
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final, Protocol

from canopen.objectdictionary import ObjectDictionary
from canopen.objectdictionary.eds import import_eds
from canopen.sdo.exceptions import SdoAbortedError

from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    DEVICE_START,
    DEVICE_WORDS,
    PROBE,
    RESPONSE_WORDS,
    SLOT_WORDS,
    VERSION,
    Words,
    slot_start,
)
from robolink.protocols.mailbox.exports import electronic_data_sheet
from robolink_simulators.faults import LinkKind
from robolink_simulators.softmotion.mailbox.exchange import ServedAccess
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

COMMAND_OBJECT: Final = 0x2100
RESPONSE_OBJECT: Final = 0x2101
MAILBOX_OBJECT: Final = 0x2102
COMMAND_FIELDS_OBJECT: Final = 0x2110
SLOT_OBJECT: Final = 0x2200
SERIAL_NUMBER: Final = (0x1018, 4)
HEARTBEAT_TIME_OBJECT: Final = 0x1017

_BOOT_ID, _CAPABILITIES, _SNAPSHOT = 2, 3, 5
_LENGTH_DOES_NOT_FIT: Final = 0x0607_0010

Present = Callable[[], int]
"""Returns the simulated time in ns."""


class SdoAnswering(Protocol):
    """Accepts the outcome of an exchange: late, or not answered at all."""

    def let_go(self, served: ServedAccess) -> None:
        """Answer as ``served`` says."""


class MailboxObjects:
    """Reads and writes of the mailbox's objects, as exchanges of the simulated PLC.

    Args:
        simulator: The PLC.
        present: Tells the simulated time.
        answering: Lets answers go.
    """

    def __init__(
        self, simulator: SoftMotionSimulator, present: Present, answering: SdoAnswering
    ) -> None:
        self._simulator = simulator
        self._present = present
        self._answering = answering
        self._fields = [
            (field.word + n * field.type.words, field.type.words)
            for field in COMMAND.fields
            for n in range(field.count)
        ]
        with simulator.lock:
            self._copy = simulator.plc.response(simulator.now_ns)

    def read(self, *, index: int, subindex: int, od: object) -> bytes | int | float | None:  # noqa: ARG002 - canopen's own signature
        """Return the content of an object, ``None`` if the dictionary itself knows it."""
        if index == RESPONSE_OBJECT:
            return self._given(self._read_copy())
        if (index, subindex) == SERIAL_NUMBER:
            return self._given(self._read(DEVICE_START, DEVICE_WORDS), 2)
        if index == SLOT_OBJECT and subindex:
            return self._given(self._read(slot_start(subindex), SLOT_WORDS))
        with self._simulator.lock:
            content = self._unwatched(index, subindex)
        self._answering.let_go(ServedAccess(delay_s=self._simulator.answer_s))
        return content

    def write(self, *, index: int, subindex: int, od: object, data: bytes) -> None:  # noqa: ARG002 - canopen's own signature
        """Accept a client's write.

        Raises:
            SdoAbortedError: The length does not fit.
        """
        if index == COMMAND_OBJECT:
            self._put(0, _unpacked(data, COMMAND_WORDS))
        elif index == COMMAND_FIELDS_OBJECT and subindex:
            start, count = self._fields[subindex - 1]
            self._put(start, _unpacked(bytes(data).ljust(2 * count, b"\0"), count))
        elif (index, subindex) == (MAILBOX_OBJECT, _SNAPSHOT):
            with self._simulator.lock:
                served = self._simulator.snapshot(self._present())
                self._copy = served.words
            self._answering.let_go(served)

    def fresh(self) -> bytes:
        """Return the response as it is now, whatever was copied."""
        with self._simulator.lock:
            now_ns = self._present()
            self._simulator.advance(now_ns)
            return packed(self._simulator.plc.response(now_ns))

    def _read_copy(self) -> ServedAccess:
        with self._simulator.lock:
            if not self._simulator.options.mailbox.snapshot_latched:
                self._copy = _unpacked(self.fresh(), RESPONSE_WORDS)
            return self._simulator.read_copy(self._copy, self._present())

    def _read(self, first: int, count: int) -> ServedAccess:
        with self._simulator.lock:
            return self._simulator.read(first, count, self._present(), LinkKind.CAN)

    def _put(self, first: int, words: Words) -> None:
        with self._simulator.lock:
            served = self._simulator.write(first, words, self._present(), LinkKind.CAN)
        self._answering.let_go(served)

    def _given(self, served: ServedAccess, count: int | None = None) -> bytes:
        self._answering.let_go(served)
        return packed(served.words[:count])

    def _unwatched(self, index: int, subindex: int) -> bytes | int | float | None:
        """Return the content of an object whose reads are no exchange of the mailbox."""
        command = self._simulator.plc.program.inbox.words
        if index == COMMAND_OBJECT:
            return packed(command)
        if index == COMMAND_FIELDS_OBJECT and subindex:
            start, count = self._fields[subindex - 1]
            return packed(command[start : start + count])
        return self._constant(subindex) if index == MAILBOX_OBJECT else None

    def _constant(self, subindex: int) -> int | float | None:
        plc = self._simulator.plc
        values: dict[int, int | float] = {
            1: VERSION,
            _BOOT_ID: plc.memory.boot_id,
            _CAPABILITIES: plc.program.capabilities.value,
            4: PROBE,
            _SNAPSHOT: 0,
        }
        return values.get(subindex)


@cache
def object_dictionary(node: int) -> ObjectDictionary:
    """Return the objects of the mailbox's own data sheet, read once: they hold no values.

    The heartbeat's period cannot be written here: canopen would start a second one.
    """
    sheet: Any = io.StringIO(electronic_data_sheet())
    read: Any = import_eds  # canopen declares no types for it
    objects: ObjectDictionary = read(sheet, node)
    period: Any = objects[HEARTBEAT_TIME_OBJECT]
    period.access_type = "const"
    return objects


def packed(words: Sequence[int]) -> bytes:
    """Return words as a PLC's memory holds them: low byte first."""
    return struct.pack(f"<{len(words)}H", *words)


def _unpacked(data: bytes, count: int) -> Words:
    if len(data) != 2 * count:
        raise SdoAbortedError(_LENGTH_DOES_NOT_FIT)
    return struct.unpack(f"<{count}H", data)
