"""What one session with a PLC has shown its client, and what must therefore not leave in it."""

import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from robolink.protocols.mailbox import (
    COMMAND,
    RESPONSE,
    BlockError,
    CommandState,
    Opcode,
    Words,
    decode_command,
    decode_response,
    encode_command,
)

_CRC: Final = COMMAND["crc"].word
_BOOT: Final = RESPONSE["boot_id"].word
_ACK: Final = RESPONSE["ack_head"].word
_TAKEN_OVER: Final = 0x00A5_0000
_ENDED: Final = (CommandState.DONE, CommandState.ABORTED, CommandState.ERROR)
_FOLLOWED: Final = (Opcode.MOVE_DIRECT, Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT, Opcode.JOG)
"""Their ends stand elsewhere than behind the acknowledgement."""


class SeenSession:
    """Follows the blocks of a session; knows nothing of the driver.

    The rules are those of docs/mailbox.md, "When a command counts": a session ends with the start
    of the PLC that it met, and with an acknowledgement of another client in place of its own; a
    block is written again only after the PLC has counted a damaged one. Who has seen that is one
    thread: another one may be about to write, and learns it with its own next look.

    Attributes:
        overtaken: Whether another client was acknowledged in the place of its last command.
    """

    def __init__(self) -> None:
        self._boot_id = 0
        self._over: dict[int, str] = {}
        self._written: tuple[int, ...] = ()
        self._proved = False
        self._rejected = 0
        self.overtaken = False

    def written(self, words: Sequence[int], rejected: int) -> str:
        """Note a command block before it leaves, and return why it must not; empty where it may.

        Args:
            words: The block.
            rejected: How many damaged blocks the PLC has counted by now.
        """
        block = tuple(words[: _CRC + 1])
        again = block == self._written and rejected == self._rejected
        self._written, self._rejected, self._proved = block, rejected, False
        if again:
            return "it was written before, and nothing was damaged"
        return self._over.get(threading.get_ident(), "")

    def answered(self, words: Words) -> None:
        """Note a response block that the client has read."""
        starts_anew = words[_BOOT] != self._boot_id
        acknowledged = bool(self._written) and words[_ACK] == self._written[0]
        if not starts_anew and not acknowledged:
            return
        try:
            now = decode_response(words)
        except BlockError:
            return  # it is read again
        if self._boot_id and now.boot_id != self._boot_id:
            self._over[threading.get_ident()] = "the PLC has restarted since"
        self._boot_id = self._boot_id or now.boot_id
        if not acknowledged or self._proved:
            return
        ours = decode_command((*self._written, 0, self._written[0]))
        # What comes after the answer to it, under the same number, takes nobody's place.
        ended = now.state in _ENDED or ours.opcode in _FOLLOWED
        self._proved = now.ack_owner == ours.owner and ended
        # A take may have succeeded although somebody else was answered since; it names the holder.
        took = ours.opcode == Opcode.OWNERSHIP and now.answer.holder == ours.owner
        self.overtaken = now.ack_owner != ours.owner and not took
        if self.overtaken:
            self._over[threading.get_ident()] = "another client was acknowledged in its place"


def another_clients(words: Sequence[int]) -> Words:
    """Return the block of another client that chose the same number for the same opcode."""
    command = decode_command(words)
    return encode_command(replace(command, owner=command.owner ^ _TAKEN_OVER), heartbeat=0)
