"""The contract of a link to a PLC mailbox.

Source: docs/reference/rules.md 11; docs/reference/mailbox.md.
"""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple, Protocol

from robolink.timing import Clock

COMMAND_WORDS: Final = 64
RESPONSE_WORDS: Final = 112
SLOT_WORDS: Final = 36
SLOTS: Final = 15
DEVICE_WORDS: Final = 4
HEARTBEAT_WORD: Final = 62
"""Word of the client's heartbeat in the command block."""
_OPCODE_WORD: Final = 1
_RELEASE_WORDS: Final = slice(4, 6)
_STOP: Final = 2003


class MailboxHead(NamedTuple):
    """The first words to change in the response block.

    It only says *when* to read the block; nothing is decided from it.
    """

    ack: int
    state: int
    error_class: int
    group_state: int
    heartbeat: int


HEAD_PLACES: Final = MailboxHead(ack=1, state=2, error_class=3, group_state=7, heartbeat=9)
"""Word of each part of the head in the response block."""


class MailboxLink(Protocol):
    """Moves the blocks of one PLC mailbox; knows their sizes and places, not their meaning.

    Words are 0 to 65535. One exchange at a time, under a lock of the link's own, and one
    deadline for the whole of it. Nothing is ever sent twice and no link is renewed by itself.
    After any error but :class:`~robolink.errors.RejectedError` of a TCP or CAN link, the link
    is closed; a serial line finds its place again before it takes another answer.

    Each method that exchanges something raises:
        TransportTimeoutError: No answer in time. What was written may have arrived.
        TransportBrokenError: The far side, the cable or the bus ended the link.
        TransportClosedError: The link was closed.
        RemoteProtocolError: What came makes no sense.
        RejectedError: A well-formed refusal (Modbus exception, SDO abort): not done.
    """

    @property
    def identity(self) -> str:
        """The far end's identity: the URL, without the options that do not identify it."""

    @property
    def place(self) -> str:
        """Where the far end was reached, the same for each spelling of the URL."""

    @property
    def durable(self) -> bool:
        """Whether the far end outlives this process, so that markers about it must too."""

    @property
    def clock(self) -> Clock:
        """The clock on which deadlines are kept."""

    @property
    def whole_look_s(self) -> float:
        """How long the response block and a beat take on the line alone, without the PLC's time.

        0 where the line is too fast to count: on a network, and inside this process.
        """

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """Write the 64 words of the command block in one piece.

        Args:
            words: The block.
            admit: Asked directly before the block leaves, after all that a link sends ahead of it.
                What it raises is raised, the block is not sent, and the link stays open.
        """

    def read_head(self) -> MailboxHead:
        """Return the beginning of the response block, as fresh as possible."""

    def read_response(self) -> tuple[int, ...]:
        """Return the 112 words of the response block, read in one piece."""

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """Return the 36 words of tool slot 1 to 15."""

    def read_device(self) -> tuple[int, ...]:
        """Return the 4 words behind the last slot, which say which PLC this is.

        A far end that has none of them refuses with
        :class:`~robolink.errors.RejectedError`, whatever the link.
        """

    def beat(self, word: int) -> None:
        """Write the client's heartbeat alone, word 62 of the command block."""

    def reopened(self, *, timeout_s: float) -> "MailboxLink":
        """Open another link to the same far end, after this one has ended; never by itself.

        Raises:
            ConnectError: It cannot be reached.
        """

    def close(self) -> None:
        """Close. Idempotent; any thread may call it at any time."""


def require_words(words: Sequence[int], count: int) -> tuple[int, ...]:
    """Return ``words``, which must be ``count`` numbers of 0 to 65535.

    Raises:
        ValueError: They are not; a mistake of the caller.
    """
    if len(words) != count or (count and (min(words) < 0 or max(words) > 0xFFFF)):
        message = f"not {count} words of 0..65535"
        raise ValueError(message)
    return tuple(words)


def is_stop(command: Sequence[int]) -> bool:
    """Return whether a command block stops the axis group: 2003, which does not release it.

    Some links let it pass where they let nothing else pass, so what is sent decides, and nobody's
    word for it.
    """
    return command[_OPCODE_WORD] == _STOP and not any(command[_RELEASE_WORDS])


def require_slot(slot: int) -> int:
    """Return ``slot``, which must be 1 to 15.

    Raises:
        ValueError: It is not; a mistake of the caller.
    """
    if not 1 <= slot <= SLOTS:
        message = f"no tool slot {slot}"
        raise ValueError(message)
    return slot
