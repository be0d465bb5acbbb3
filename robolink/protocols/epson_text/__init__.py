"""EPSON Remote Ethernet: ``$Name,parameter`` and back, for both ends of the line."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.protocols.epson_text._codec import EpsonCodec, EpsonTextCodec
from robolink.protocols.epson_text._commands import (
    COMMANDS,
    ParameterForm,
    RemoteCommand,
    ReplyShape,
    VariableType,
    find_command,
)
from robolink.protocols.epson_text._events import (
    BadRequest,
    EndOfStream,
    ErrorCode,
    Event,
    Opening,
    Refusal,
    Reply,
    Request,
)
from robolink.protocols.epson_text._status import (
    Preference,
    StatusFlags,
    parse_preferences,
    parse_status,
    preferences_field,
    status_fields,
)

__all__ = [
    "BadRequest",
    "COMMANDS",
    "EndOfStream",
    "EpsonCodec",
    "EpsonTextCodec",
    "ErrorCode",
    "Event",
    "Opening",
    "ParameterForm",
    "Preference",
    "Refusal",
    "RemoteCommand",
    "Reply",
    "ReplyShape",
    "Request",
    "StatusFlags",
    "VariableType",
    "find_command",
    "parse_preferences",
    "parse_status",
    "preferences_field",
    "status_fields",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
