"""A dialogue made fit to be handed on."""

import re
from dataclasses import replace
from typing import Final

from robolink.transport import Dialogue, Passage

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
