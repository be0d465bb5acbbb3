"""What was found out.

Asks a controller one thing after the other and keeps the raw stream.
"""

import re
from dataclasses import dataclass, replace
from typing import Final

from robolink.controllers.epson.answers import may_log_out
from robolink.controllers.epson.controller import EpsonController
from robolink.controllers.epson.session import EpsonSession, execution
from robolink.controllers.epson.window import CommandWindow
from robolink.errors import ControllerError, RejectedError
from robolink.model import ControllerFacts
from robolink.protocols.epson_text import Reply, parse_status
from robolink.protocols.spel import Statement, wait_half_a_second
from robolink.timing import Deadline
from robolink.transport import Dialogue, DialogueLog, Passage, Transport

PROFILE_SCHEMA: Final = "robolink/epson-profile/1"

OptionValue = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Fact:
    """One thing that documents leave open, and what this controller does.

    Attributes:
        name: What it is about, for a person.
        finding: What this controller does; why that is not known, when it is not settled.
        option: The simulator's option for it; empty when there is none.
        value: That option's value, ``None`` when the fact is not settled.
        evidence: The bytes or the text that show it.
    """

    name: str
    finding: str
    option: str = ""
    value: OptionValue | None = None
    evidence: str = ""

    @property
    def settled(self) -> bool:
        """Whether this controller showed what it does."""
        return bool(self.evidence)


@dataclass(frozen=True, slots=True)
class Verification:
    """Everything that was found out about one controller.

    Attributes:
        controller: Its identity.
        about: What it says about itself.
        facts: Settled and unsettled ones.
        dialogue: All that was said, without the login.
    """

    controller: str
    about: ControllerFacts
    facts: tuple[Fact, ...]
    dialogue: Dialogue

    @property
    def options(self) -> dict[str, OptionValue]:
        """The simulator's options that this controller determined."""
        return {fact.option: fact.value for fact in self.facts if fact.value is not None}

    def profile(self, *, redact: bool = False) -> dict[str, object]:
        """Return the cell profile as plain values; ``redact`` leaves out its identity."""
        models = self.about.robot_models
        return {
            "schema": PROFILE_SCHEMA,
            "controller": "" if redact else self.controller,
            "controller_type": self.about.controller_type,
            "firmware": self.about.firmware,
            "robot": models[0] if models else None,
            "robot_serials": [] if redact else list(self.about.robot_serials),
            "options": self.options,
            "unsettled": {
                fact.option: fact.finding
                for fact in self.facts
                if fact.option and fact.value is None
            },
        }


_HIDDEN: Final = b"***"
_ONE: Final = re.compile(rb"#(GetContNo|GetContName|GetContMacAdd),[^\r\n]*", re.I)
_PER_ROBOT: Final = re.compile(rb"#(GetRobotSerial|GetRobotName),([0-9]+)((?:,[^,\r\n]*)*)", re.I)
_PRINTED: Final = re.compile(rb'#Execute,"[^"]*"', re.I)
_ASKS_SERIAL: Final = re.compile(rb"Robot(?:Serial|Name)\$", re.I)


def redacted(dialogue: Dialogue) -> Dialogue:
    """Return the dialogue without names, serial numbers and the address of the controller.

    The login is not in a dialogue in the first place.
    """
    hidden: list[Passage] = []
    asked = b""
    for passage in dialogue.joined().passages:
        data = passage.data
        if passage.direction == "sent":
            asked = data
        else:
            data = _ONE.sub(rb"#\1," + _HIDDEN, data)
            data = _PER_ROBOT.sub(_each_hidden, data)
            if _ASKS_SERIAL.search(asked):
                data = _PRINTED.sub(b'#Execute,"' + _HIDDEN + b'"', data)
        hidden.append(replace(passage, data=data))
    return Dialogue("", dialogue.began_at, tuple(hidden))


def _each_hidden(match: re.Match[bytes]) -> bytes:
    # The number of fields stays the same, so that the dialogue can be replayed.
    return b"#%s,%s%s" % (match[1], match[2], (b"," + _HIDDEN) * match[3].count(b","))


_PATIENCE_S = 0.5
"""Wait for an answer to a request sent without its terminator, in s."""

_LONGEST_WAIT_S = 5.0
_POLL_S = 0.1


class Interview:
    """One client's questions. Nothing here writes a value or moves the robot.

    Once a statement has failed, none is sent any more: the controller may be in error.

    Attributes:
        controller: For what the driver reads anyway.
    """

    def __init__(
        self,
        controller: EpsonController,
        session: EpsonSession,
        transport: Transport,
        log: DialogueLog,
    ) -> None:
        self.controller = controller
        self._session = session
        self._transport = transport
        self._log = log
        self._window = CommandWindow(session)
        self._no_more = ""

    @property
    def heard(self) -> bytes:
        """All that the controller has sent so far."""
        pieces = self._log.dialogue.passages
        return b"".join(piece.data for piece in pieces if piece.direction == "received")

    def ask(self, name: str, *parameters: str) -> tuple[str, ...] | int:
        """Return the fields of an answer, or the code of a refusal."""
        try:
            return self._session.exchange(name, *parameters).fields
        except RejectedError as error:
            return error.code

    def echo(self, name: str) -> str:
        """Return the name that an answer carries."""
        return self._session.exchange(name).name

    def why_no_statement(self) -> str:
        """Return why no statement can be run now, empty when one can."""
        if not self._no_more:
            try:
                self._window.require_ready("Print Tool")
            except ControllerError as error:
                self._no_more = error.what
        return self._no_more

    def printed(self, query: Statement) -> str | None:
        """Return what a statement printed, ``None`` when it was not or could not be run.

        A statement that printed nothing gives an empty text.
        """
        if self.why_no_statement():
            return None
        answer = self._session.ask(execution(query))
        if isinstance(answer, Reply) and answer.fields == ("0",):
            return ""
        if isinstance(answer, Reply) and answer.text is not None:
            return answer.text
        self._no_more = self._window.failure(query, answer).what
        return None

    def flags_while_waiting(self) -> str | None:
        """Return the flags that GetStatus shows while a statement runs for half a second."""
        if self.why_no_statement():
            return None
        pending = self._session.start_execute(wait_half_a_second())
        reply = self._session.exchange("GetStatus")
        parse_status(reply)
        too_early = pending.answer is not None
        deadline = Deadline.after(self._session.clock, _LONGEST_WAIT_S)
        while pending.answer is None and not deadline.expired:
            self._session.await_pending(wait_s=_POLL_S)
        self._session.finish(pending)
        if pending.answer is not None and pending.answer != Reply(pending.answer.name, ("0",)):
            self._no_more = self._window.failure(pending.statement, pending.answer).what
            return None
        return None if too_early else reply.fields[0]

    def log_out(self) -> None:
        """Log out if that is harmless, and close."""
        if may_log_out(self.controller.status()):
            self._session.exchange("Logout")
        self._session.close()

    def leave(self) -> bool | None:
        """Log out and close; return whether Logout was answered before its line end came.

        Logout is the one request after which nothing can be mistaken any more. The line end
        follows in any case. Where it would do harm the connection is just closed, and ``None``
        returned.
        """
        if not may_log_out(self.controller.status()):
            self._session.close()
            return None
        clock = self._session.clock
        request, end = b"$Logout", b"\r\n"
        self._transport.send(request, deadline=Deadline.after(clock, _PATIENCE_S))
        early = self._transport.wait_readable(deadline=Deadline.after(clock, _PATIENCE_S))
        if not early:
            self._transport.send(end, deadline=Deadline.after(clock, _PATIENCE_S))
        self._transport.receive(deadline=Deadline.after(clock, self._session.timeout_s))
        self._session.close()
        return early
