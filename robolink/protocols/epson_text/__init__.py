"""EPSON Remote Ethernet: ``$Name,parameter`` and back, for both ends of the line."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports
from robolink.protocols._role import NEED_DATA as NEED_DATA
from robolink.protocols._role import Role as Role

if TYPE_CHECKING:
    from robolink.protocols.epson_text._codec import EpsonCodec as EpsonCodec
    from robolink.protocols.epson_text._codec import EpsonTextCodec as EpsonTextCodec
    from robolink.protocols.epson_text._commands import COMMANDS as COMMANDS
    from robolink.protocols.epson_text._commands import ParameterForm as ParameterForm
    from robolink.protocols.epson_text._commands import RemoteCommand as RemoteCommand
    from robolink.protocols.epson_text._commands import ReplyShape as ReplyShape
    from robolink.protocols.epson_text._commands import VariableType as VariableType
    from robolink.protocols.epson_text._commands import find_command as find_command
    from robolink.protocols.epson_text._events import BadRequest as BadRequest
    from robolink.protocols.epson_text._events import EndOfStream as EndOfStream
    from robolink.protocols.epson_text._events import ErrorCode as ErrorCode
    from robolink.protocols.epson_text._events import Event as Event
    from robolink.protocols.epson_text._events import Opening as Opening
    from robolink.protocols.epson_text._events import Refusal as Refusal
    from robolink.protocols.epson_text._events import Reply as Reply
    from robolink.protocols.epson_text._events import Request as Request
    from robolink.protocols.epson_text._preferences import Preference as Preference
    from robolink.protocols.epson_text._preferences import parse_preferences as parse_preferences
    from robolink.protocols.epson_text._preferences import preferences_field as preferences_field
    from robolink.protocols.epson_text._status import StatusFlags as StatusFlags
    from robolink.protocols.epson_text._status import parse_status as parse_status
    from robolink.protocols.epson_text._status import status_fields as status_fields
else:
    __getattr__ = lazy_exports(
        __name__,
        {
            "_codec": "EpsonCodec EpsonTextCodec",
            "_commands": (
                "COMMANDS RemoteCommand ParameterForm ReplyShape VariableType find_command"
            ),
            "_events": "BadRequest EndOfStream ErrorCode Event Opening Refusal Reply Request",
            "_preferences": "Preference parse_preferences preferences_field",
            "_status": "StatusFlags parse_status status_fields",
        },
    )
