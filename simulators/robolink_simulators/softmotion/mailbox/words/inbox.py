"""The command block as clients write it, and which command in it is a new one."""

from collections.abc import Sequence
from typing import Final

from robolink.protocols.mailbox import (
    COMMAND,
    COMMAND_WORDS,
    BlockError,
    BlockFault,
    Command,
    WordOrder,
    Words,
    decode_command,
)
from robolink_simulators.softmotion.mailbox.words.image import arranged

_CRC: Final = COMMAND["crc"].word
_HEARTBEAT: Final = COMMAND["client_heartbeat"].word


class Inbox:
    """The words that clients write, as the program finds them.

    Args:
        order: How the program lays values of several words.

    Attributes:
        rejected: Distinct blocks whose checksum was wrong.
    """

    def __init__(self, order: WordOrder) -> None:
        self._order = order
        self._image = [0] * COMMAND_WORDS
        self._damaged: set[tuple[int, int]] = set()
        self._settled: list[tuple[int, int, int]] = []
        self.rejected = 0

    @property
    def words(self) -> Words:
        """The words as they stand."""
        return tuple(self._image)

    @property
    def heartbeat(self) -> int:
        """The client's heartbeat word."""
        return self._image[_HEARTBEAT]

    def write(self, first: int, words: Sequence[int]) -> None:
        """Take what a client writes from a word on."""
        self._image[first : first + len(words)] = words

    def lay_words(self, order: WordOrder) -> None:
        """Lay values of several words in another order from now on."""
        self._order = order

    def zero(self) -> None:
        """Zero all, as a fieldbus does when its watchdog expires (documented)."""
        self._image = [0] * COMMAND_WORDS

    def new_command(self) -> Command | None:
        """Return the command that stands there, ``None`` when there is nothing new.

        What is torn, empty or damaged is none; damage is counted, each (head, crc) once.
        """
        try:
            command = decode_command(arranged(COMMAND, self._image, self._order))
        except BlockError as error:
            if error.fault is BlockFault.CRC and (error.head, error.crc) not in self._damaged:
                self._damaged.add((error.head, error.crc))
                self.rejected = self.rejected + 1 & 0xFFFF
            return None
        return None if self._fingerprint(command) in self._settled else command

    def accept(self, command: Command) -> None:
        """Remember a command: when it stands there again it is the same one."""
        self._settled = [self._fingerprint(command)]

    def hold_back(self, command: Command) -> None:
        """Remember a command that came too early: it is not carried out later either."""
        self._settled.append(self._fingerprint(command))

    def _fingerprint(self, command: Command) -> tuple[int, int, int]:
        return (command.owner, command.sequence, self._image[_CRC])
