"""What was found out."""

import re
from dataclasses import dataclass, replace
from typing import Final

from robolink.model import ControllerFacts
from robolink.transport import Dialogue, Passage

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
        """The simulator's options that this controller settled."""
        return {fact.option: fact.value for fact in self.facts if fact.value is not None}

    def profile(self, *, redact: bool = False) -> dict[str, object]:
        """Return the cell profile as plain values; ``redact`` leaves out whose it is."""
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
    # The number of fields stays, so that the dialogue can be replayed.
    return b"#%s,%s%s" % (match[1], match[2], (b"," + _HIDDEN) * match[3].count(b","))
