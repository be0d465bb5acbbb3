r"""The traffic of a connection as a file: evidence that can be read, mailed and replayed.

One JSON object a line. A connection begins with a line that carries the schema; each line
after it is one piece of the stream. Bytes are written as the characters of the same number
(latin-1), so that a dialogue in text reads as text and nothing is lost::

    {"schema": "robolink/dialogue/1", "controller": "epson+tcp://192.168.0.1:5000", ...}
    {"t_s": 0.0, "secret": true}
    {"t_s": 0.004, "received": "#Login,0\r\n"}
    {"t_s": 0.005, "sent": "$GetStatus\r\n"}

The login is not in the file at all: only that one was sent. Nor is an answer that may repeat it:
only that one came, ``{"t_s": 0.004, "secret": "received"}``.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import NS_PER_S
from robolink.transport.traffic import SECRET_PLACEHOLDER, Direction

SCHEMA: Final = "robolink/dialogue/1"


@dataclass(frozen=True, slots=True)
class Passage:
    """One piece of the stream.

    Attributes:
        at_s: Seconds since the first piece.
        direction: ``sent`` by the client or ``received`` by it.
        data: The bytes; a received ``b""`` is the end of the stream.
        secret: A login went here, or an answer that may repeat one; ``data`` is empty.
    """

    at_s: float
    direction: Direction
    data: bytes
    secret: bool = False


@dataclass(frozen=True, slots=True)
class Dialogue:
    """One connection from its beginning.

    Attributes:
        controller: Identity of the far end; may be empty.
        began_at: Wall-clock label, ISO 8601 UTC.
        passages: What went over it, in order.
    """

    controller: str
    began_at: str
    passages: tuple[Passage, ...]

    def joined(self) -> "Dialogue":
        """Return the dialogue with consecutive pieces of one direction joined."""
        passages = []
        for (direction, secret), group in groupby(
            self.passages, lambda passage: (passage.direction, passage.secret)
        ):
            pieces = list(group)
            data = b"".join(piece.data for piece in pieces)
            passages.append(Passage(pieces[0].at_s, direction, data, secret))
        return Dialogue(self.controller, self.began_at, tuple(passages))


class DialogueLog:
    """A :data:`~robolink.transport.TraceSink` that keeps one connection in memory.

    Args:
        controller: Identity of the far end.
        began_at: Wall-clock label.
    """

    def __init__(self, controller: str, began_at: str) -> None:
        self._controller = controller
        self._began_at = began_at
        self._passages: list[Passage] = []
        self._began_ns: int | None = None

    def __call__(self, at_ns: int, direction: Direction, data: bytes) -> None:
        """Keep one piece."""
        self.keep(at_ns, direction, data)

    def keep(self, at_ns: int, direction: Direction, data: bytes) -> Passage:
        """Keep one piece and return it.

        Args:
            at_ns: When, on the clock of the link; the first one kept is at 0.
            direction: Which way it went.
            data: The bytes.

        Example:
            >>> from robolink.transport import DialogueLog
            >>> log = DialogueLog("epson+tcp://192.168.0.1:5000", "2026-11-23T08:00:00Z")
            >>> log.keep(5_000_000_000, "sent", b"$GetStatus").at_s
            0.0
            >>> log.keep(5_250_000_000, "received", b"#GetStatus,00100000001,0000").at_s
            0.25
        """
        if self._began_ns is None:
            self._began_ns = at_ns
        secret = data == SECRET_PLACEHOLDER
        at_s = (at_ns - self._began_ns) / NS_PER_S
        passage = Passage(at_s, direction, b"" if secret else data, secret)
        self._passages.append(passage)
        return passage

    @property
    def dialogue(self) -> Dialogue:
        """What was kept so far."""
        return Dialogue(self._controller, self._began_at, tuple(self._passages))


def format_dialogue(dialogue: Dialogue) -> str:
    """Return the lines of a dialogue."""
    lines = [opening_line(dialogue), *(passage_line(piece) for piece in dialogue.passages)]
    return "\n".join(lines) + "\n"


def opening_line(dialogue: Dialogue) -> str:
    """Return the line with which a connection begins."""
    return json.dumps(
        {"schema": SCHEMA, "controller": dialogue.controller, "began_at": dialogue.began_at}
    )


def passage_line(passage: Passage) -> str:
    """Return the line of one piece."""
    line: dict[str, object] = {"t_s": round(passage.at_s, 6)}
    if passage.secret:
        line["secret"] = True if passage.direction == "sent" else passage.direction
    else:
        line[passage.direction] = passage.data.decode("latin-1")
    return json.dumps(line)


def parse_dialogues(text: str, *, source: str) -> tuple[Dialogue, ...]:
    """Read every connection of a recording.

    Args:
        text: The lines.
        source: Where they come from, for messages.

    Raises:
        ConfigError: Names the first line that does not belong there.
    """
    return tuple(
        Dialogue(controller, began_at, tuple(passages))
        for controller, began_at, passages in _connections(text.splitlines(), source)
    )


def _connections(lines: Iterable[str], source: str) -> Iterator[tuple[str, str, list[Passage]]]:
    current: tuple[str, str, list[Passage]] | None = None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            read = json.loads(line)
            if "schema" in read:
                if read["schema"] != SCHEMA:
                    raise ValueError(read["schema"])
                if current is not None:
                    yield current
                current = (str(read["controller"]), str(read["began_at"]), [])
                continue
            if current is None:
                raise ValueError
            current[2].append(_passage(read))
        except (KeyError, RecursionError, TypeError, ValueError) as error:
            raise _unreadable(source, number) from error
    if current is None:
        raise _unreadable(source, 1)
    yield current


def _passage(line: dict[str, object]) -> Passage:
    at_s = float(str(line["t_s"]))
    direction: Direction = "sent" if "sent" in line else "received"
    if secret := line.get("secret"):
        return Passage(at_s, "sent" if secret is True else "received", b"", secret=True)
    data = line[direction]
    if not isinstance(data, str):
        raise TypeError(data)
    return Passage(at_s, direction, data.encode("latin-1"))


def _unreadable(source: str, number: int) -> ConfigError:
    return ConfigError(
        tr("Line {number} of {source} is not part of a dialogue.", number=number, source=source),
        remedy=tr(
            "Give a file that {record} has written.", record=remedy_word(RemedyWord.DIALOGUE_FILE)
        ),
    )
