"""Moves bytes to and from a far end; knows no protocol."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.transport._mailbox_link import MailboxHead as MailboxHead
    from robolink.transport._mailbox_link import MailboxLink as MailboxLink
    from robolink.transport._registry import TRANSPORTS_GROUP as TRANSPORTS_GROUP
    from robolink.transport._registry import TransportOpener as TransportOpener
    from robolink.transport._registry import open_mailbox_link as open_mailbox_link
    from robolink.transport._registry import open_modbus as open_modbus
    from robolink.transport._registry import open_opcua as open_opcua
    from robolink.transport._registry import open_transport as open_transport
    from robolink.transport._url import LinkUrl as LinkUrl
    from robolink.transport._url import UrlOptions as UrlOptions
    from robolink.transport._url import far_end_of as far_end_of
    from robolink.transport._url import parse_url as parse_url
    from robolink.transport._url import serves_several as serves_several
    from robolink.transport.byte_stream import TracingTransport as TracingTransport
    from robolink.transport.byte_stream import Transport as Transport
    from robolink.transport.dialogue import Dialogue as Dialogue
    from robolink.transport.dialogue import DialogueLog as DialogueLog
    from robolink.transport.dialogue import Passage as Passage
    from robolink.transport.dialogue import format_dialogue as format_dialogue
    from robolink.transport.dialogue import opening_line as opening_line
    from robolink.transport.dialogue import parse_dialogues as parse_dialogues
    from robolink.transport.dialogue import passage_line as passage_line
    from robolink.transport.traffic import SECRET_PLACEHOLDER as SECRET_PLACEHOLDER
    from robolink.transport.traffic import Direction as Direction
    from robolink.transport.traffic import TraceSink as TraceSink
    from robolink.transport.traffic import Traffic as Traffic
    from robolink.transport.traffic import told_to as told_to
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_mailbox_link": "MailboxHead MailboxLink",
            "_registry": (
                "TRANSPORTS_GROUP TransportOpener open_mailbox_link open_modbus open_opcua "
                "open_transport"
            ),
            "_url": "LinkUrl UrlOptions far_end_of parse_url serves_several",
            "byte_stream": "TracingTransport Transport",
            "dialogue": (
                "Dialogue DialogueLog Passage format_dialogue opening_line "
                "parse_dialogues passage_line"
            ),
            "traffic": "Direction SECRET_PLACEHOLDER TraceSink Traffic told_to",
        },
        old_names(__name__),
    )
