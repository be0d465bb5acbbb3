"""Moves bytes to and from a far end; knows no protocol."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.transport._mailbox_link import MailboxHead as MailboxHead
    from robolink.transport._mailbox_link import MailboxLink as MailboxLink
    from robolink.transport._registry import TRANSPORTS_GROUP as TRANSPORTS_GROUP
    from robolink.transport._registry import TransportOpener as TransportOpener
    from robolink.transport._registry import open_mailbox_link as open_mailbox_link
    from robolink.transport._registry import open_modbus as open_modbus
    from robolink.transport._registry import open_quick_link as open_quick_link
    from robolink.transport._registry import open_transport as open_transport
    from robolink.transport._url import LinkUrl as LinkUrl
    from robolink.transport._url import parse_url as parse_url
    from robolink.transport._url_options import UrlOptions as UrlOptions
    from robolink.transport.stream.contract import Transport as Transport
    from robolink.transport.stream.dialogue import Dialogue as Dialogue
    from robolink.transport.stream.dialogue import DialogueLog as DialogueLog
    from robolink.transport.stream.dialogue import Passage as Passage
    from robolink.transport.stream.dialogue import format_dialogue as format_dialogue
    from robolink.transport.stream.dialogue import opening_line as opening_line
    from robolink.transport.stream.dialogue import parse_dialogues as parse_dialogues
    from robolink.transport.stream.dialogue import passage_line as passage_line
    from robolink.transport.stream.trace import SECRET_PLACEHOLDER as SECRET_PLACEHOLDER
    from robolink.transport.stream.trace import Direction as Direction
    from robolink.transport.stream.trace import TraceSink as TraceSink
    from robolink.transport.stream.trace import TracingTransport as TracingTransport
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_mailbox_link": "MailboxHead MailboxLink",
            "_registry": (
                "TRANSPORTS_GROUP TransportOpener open_mailbox_link open_modbus "
                "open_quick_link open_transport"
            ),
            "_url": "LinkUrl parse_url",
            "_url_options": "UrlOptions",
            "stream.contract": "Transport",
            "stream.dialogue": (
                "Dialogue DialogueLog Passage format_dialogue opening_line "
                "parse_dialogues passage_line"
            ),
            "stream.trace": "Direction SECRET_PLACEHOLDER TraceSink TracingTransport",
        },
    )
