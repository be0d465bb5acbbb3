"""One request under way, and the way to answer it."""

from dataclasses import dataclass
from typing import Protocol

from robolink.protocols.epson_text import Refusal, Reply
from robolink_simulators.faults import Fault, FaultAction


class Answering(Protocol):
    """Takes the answer to the client, if it is still there."""

    def answer(self, exchange: "PendingRequest", event: Reply | Refusal) -> None:
        """Let the answer leave."""


@dataclass(frozen=True, slots=True)
class PendingRequest:
    """A request that came in.

    Attributes:
        number: Running number over all clients, from 1.
        name: The command in the case in which the client wrote it; the answer echoes it.
        faults: What is planned to go wrong with it.
        link: Where the answer goes.
    """

    number: int
    name: str
    faults: tuple[Fault, ...]
    link: Answering

    def reply(self, *fields: str) -> None:
        """Answer with fields, ``0`` when there are none."""
        self.link.answer(self, Reply(self.name, fields or ("0",)))

    def reply_text(self, text: str) -> None:
        """Answer with what a statement printed."""
        self.link.answer(self, Reply(self.name, text=text))

    def refuse(self, code: int) -> None:
        """Answer with an error code."""
        self.link.answer(self, Refusal(self.name, int(code)))

    def meets(self, action: FaultAction) -> bool:
        """Tell whether a fault of this kind is planned for it."""
        return any(fault.action is action for fault in self.faults)
