"""The one Execute that may be outstanding while its statement runs."""

from dataclasses import dataclass

from robolink.protocols.epson_text import Refusal, Reply
from robolink.protocols.spel import Statement


@dataclass(slots=True)
class PendingExecute:
    """An Execute that was sent; ``answer`` is set by whoever reads it."""

    statement: Statement
    answer: Reply | Refusal | None = None
    abort_requested: bool = False
