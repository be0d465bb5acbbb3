"""A PLC mailbox in three arrays of an OPC UA server (docs/reference/mailbox.md, "OPC UA").

The arrays hold the words of the registers, so that codec, sequences and checksums are the same.
The client's heartbeat is a variable of its own: writing it in the command would write the whole
command, and with it overwrite another client's.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError, RejectedError
from robolink.messages import tr
from robolink.timing import Clock
from robolink.transport._mailbox_link import (
    COMMAND_WORDS,
    DEVICE_WORDS,
    HEAD_PLACES,
    HEARTBEAT_WORD,
    RESPONSE_WORDS,
    SLOT_WORDS,
    SLOTS,
    MailboxHead,
    is_stop,
    require_slot,
    require_words,
)
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.opcua import errors as errors
from robolink.transport.opcua.opening import open_client
from robolink.transport.opcua.security import completed, take_security
from robolink.transport.traffic import told_alike

if TYPE_CHECKING:
    from robolink.model import Secret
    from robolink.transport.opcua.client import OpcuaClient

SYMBOLS: Final = "RL_Symbols"
"""The global variable list of the exported program that holds the arrays."""

USUAL_WAY: Final = f"/DeviceSet/*/Resources/*/GlobalVars/{SYMBOLS}"
"""Where a CODESYS server shows it, whatever device and application are called."""

_WORD: Final = "UInt16"
_FRAME_WORDS: Final = 2
_SLOTS_WORDS: Final = SLOTS * SLOT_WORDS + DEVICE_WORDS


@dataclass(frozen=True, slots=True)
class MailboxNodes:
    """The ids of the four variables."""

    command: str
    response: str
    slots: str
    heartbeat: str


def open_opcua_link(
    url: LinkUrl,
    *,
    timeout_s: float,
    clock: Clock | None = None,
    password: "Secret | None" = None,
    stopping: bool = False,
) -> "OpcuaMailboxLink":
    """Open a mailbox over OPC UA.

    Args:
        url: Option beside those of an OPC UA client: ``symbols``, id or way of the variable list,
            where a server has none at the usual way, or several.
        timeout_s: Longest wait for the connection, and for each exchange.
        clock: Keeps the deadlines.
        password: Of the user whom the URL names.
        stopping: Whether this is for a stop: no date of a certificate holds it back, nor who else
            can read the key, nor a heartbeat that cannot be written.

    Raises:
        ConfigError: The URL or an option is wrong; there are several mailboxes.
        RejectedError: The server has no mailbox, one whose variables are of another type, or one
            of which only the command or only the heartbeat can be written.
        ConnectError, LoginRefusedError, TransportError, RemoteProtocolError: As
            :func:`~robolink.transport.opcua.opening.open_opcua`.
    """
    options = UrlOptions(url)
    symbols = options.take_text("symbols")
    asked = take_security(options)
    options.finish()
    security = completed(asked, password, url.identity, stopping=stopping)
    client = open_client(url, security, timeout_s=timeout_s, clock=clock)
    try:
        nodes = _mailbox_nodes(client, symbols)
        if client.may_write and not stopping:
            _require_equal_rights(client, nodes)
    except BaseException:
        client.close()
        raise

    @told_alike
    def again(timeout_s: float) -> OpcuaMailboxLink:
        return open_opcua_link(
            url, timeout_s=timeout_s, clock=clock, password=password, stopping=stopping
        )

    return OpcuaMailboxLink(client, nodes, symbols, again)


class OpcuaMailboxLink:
    """Implements :class:`~robolink.transport.MailboxLink` on a client, and owns it.

    A look at the head reads the whole response. There is no subscription: it would tell of a
    change later, and one that froze would tell nothing
    (docs/decisions/0012-modbus-and-canopen-libraries.md).
    """

    durable: bool = True
    """True: a PLC outlives this process."""

    whole_look_s: Final = 0.0
    """Zero: a network is too fast to count."""

    def __init__(
        self,
        client: "OpcuaClient",
        nodes: MailboxNodes,
        symbols: str,
        again: Callable[[float], "OpcuaMailboxLink"],
    ) -> None:
        self._client = client
        self._nodes = nodes
        self._which = f"?symbols={symbols}" if symbols else ""
        self._again = again
        self.identity, self.clock = client.identity + self._which, client.clock

    @property
    def place(self) -> str:
        """The client's, and which of a server's mailboxes when it is not the usual one."""
        return self._client.place + self._which

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`; one array.

        The program looks for the heartbeat in its own variable only. It goes there before the
        command, or a movement would end as it begins because its client never beat. A stop needs
        none, so that none holds it back, and goes out where nothing else may be written.
        """
        command = require_words(words, COMMAND_WORDS)
        stop = is_stop(command)
        beat = [] if stop else [(self._nodes.heartbeat, command[HEARTBEAT_WORD])]
        self._client.write_in_turn([*beat, (self._nodes.command, command)], stop=stop, admit=admit)

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`; the whole response."""
        words = self.read_response()
        return MailboxHead(*(words[place] for place in HEAD_PLACES))

    def read_response(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_response`; one array.

        It stands between two counts of PLC cycles. Without them the checksum would believe one
        in 65,536 blocks that a server tore while the robot moved.
        """
        return self._read(self._nodes.response, whole=_is_of_one_cycle)[1:-1]

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_slot`; out of the array of all."""
        start = (require_slot(slot) - 1) * SLOT_WORDS
        return self._read(self._nodes.slots)[start : start + SLOT_WORDS]

    def read_device(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_device`; out of the array of all slots."""
        return self._read(self._nodes.slots)[SLOTS * SLOT_WORDS :]

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`; a variable of its own."""
        (beat,) = require_words((word,), 1)
        self._client.write(self._nodes.heartbeat, beat)

    def reopened(self, *, timeout_s: float) -> "OpcuaMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`."""
        return self._again(timeout_s)

    def close(self) -> None:
        """See :meth:`robolink.transport.MailboxLink.close`."""
        self._client.close()

    def _read(
        self, node: str, *, whole: Callable[[Sequence[int]], bool] | None = None
    ) -> tuple[int, ...]:
        (words,) = self._client.read([node], whole=whole)
        return tuple(words)


def _is_of_one_cycle(framed: Sequence[int]) -> bool:
    return framed[0] == framed[-1]


_DUE: Final = (
    ("command", (COMMAND_WORDS,)),
    ("response", (RESPONSE_WORDS + _FRAME_WORDS,)),
    ("slots", (_SLOTS_WORDS,)),
    ("heartbeat", ()),
)


def _mailbox_nodes(client: "OpcuaClient", symbols: str) -> MailboxNodes:
    """Find the four variables and hold each against what it has to be."""
    lists = client.find(USUAL_WAY) if not symbols else (client.describe(symbols),)
    if not lists:
        raise RejectedError(
            tr(
                "{identity} has no {name} at {way}.",
                identity=client.identity,
                name=SYMBOLS,
                way=USUAL_WAY,
            ),
            remedy=tr(
                "Publish the variable list of the exported program as symbols; where it is called "
                "otherwise, add ?symbols= and its name."
            ),
            controller=client.identity,
        )
    if len(lists) > 1:
        raise ConfigError(
            tr(
                "{identity} has several mailboxes: {names}.",
                identity=client.identity,
                names=", ".join(one.id for one in lists),
            ),
            remedy=tr("Add ?symbols= and the one that is meant to the URL."),
            controller=client.identity,
        )
    found = {facts.name: facts for facts in client.browse(lists[0].id)}
    ids: dict[str, str] = {}
    for name, lengths in _DUE:
        facts = found.get(name)
        if facts is None:
            raise RejectedError(
                tr(
                    "{node} of {identity} has no {name}.",
                    node=lists[0].id,
                    identity=client.identity,
                    name=name,
                ),
                remedy=tr("Publish all four variables of {name} as symbols.", name=SYMBOLS),
                controller=client.identity,
            )
        facts = client.describe(facts.id)  # one without a value is refused by name
        if (facts.kind, facts.lengths) != (_WORD, lengths):
            due = _WORD + "".join(f"[{length}]" for length in lengths)
            raise errors.changed_type(client.identity, facts.id, due, facts.type_name)
        ids[name] = facts.id
    return MailboxNodes(**ids)


def _require_equal_rights(client: "OpcuaClient", nodes: MailboxNodes) -> None:
    """Refuse a mailbox of which half can be written; a user who may only read it, reads it."""
    both = (nodes.command, nodes.heartbeat)
    if any(client.describe(one).writable for one in both):
        for one in both:
            client.require_writable(one)
