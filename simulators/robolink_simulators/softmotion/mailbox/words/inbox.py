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
_SEQUENCES: Final = 0xFFFF
"""1 to 65535, and 1 again."""

_MOST_AHEAD: Final = _SEQUENCES // 2
"""What is farther ahead than this is behind (docs/mailbox.md, "When a command counts")."""


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
        self._newest: tuple[int, int, int] | None = None
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
        if self._fingerprint(command) in self._settled or self._is_of_before(command):
            return None
        return command

    def accept(self, command: Command, *, owned: bool) -> None:
        """Remember a command: when it stands there again it is the same one.

        Args:
            command: The command.
            owned: Whether it came from the owner, who numbers its commands upwards.
        """
        self._settled = [self._fingerprint(command)]
        self._note_number(command, owned=owned)

    def hold_back(self, command: Command, *, owned: bool) -> None:
        """Remember a command that came too early: it is not carried out later either."""
        self._settled.append(self._fingerprint(command))
        self._note_number(command, owned=owned)

    def _note_number(self, command: Command, *, owned: bool) -> None:
        if owned:
            self._newest = (command.owner, command.epoch, command.sequence)

    def _is_of_before(self, command: Command) -> bool:
        """Tell whether its owner has sent a newer one in this epoch: it comes late, or twice."""
        if self._newest is None or (command.owner, command.epoch) != self._newest[:2]:
            return False
        return not 0 < (command.sequence - self._newest[2]) % _SEQUENCES <= _MOST_AHEAD

    def _fingerprint(self, command: Command) -> tuple[int, int, int]:
        return (command.owner, command.sequence, self._image[_CRC])
