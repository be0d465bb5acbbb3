"""Listens for programs: one thread for each caller, and a limit on how many."""

import ipaddress
import socket
import threading
from collections.abc import Callable, Collection
from contextlib import closing, suppress
from typing import TYPE_CHECKING, Final

from robolink import runtime
from robolink.errors import ConfigError, RobolinkError
from robolink.messages import tr
from robolink.protocols import NEED_DATA
from robolink.protocols.spel_callback import CallbackCodec, encode_line

if TYPE_CHECKING:
    from robolink.serving._conversation import CallbackConversation

MOST_PROGRAMS: Final = 8
BEAT_S: Final = 1.0
IDLE_S: Final = 900.0
"""Time in s without a message after which a program counts as gone; its moves take minutes at most.
"""

_CHUNK: Final = 4096


class CallbackServer:
    """Listens at one address of this computer.

    Args:
        host: The address; another than a loopback one only with ``allow``.
        port: TCP port, 0 for any that is free.
        conversation: Makes the partner of one program, given from where it calls.
        allow: Addresses that may call; empty for this computer only.
        tell: Told, in sentences, why a program was sent away or cut, or why none can call.

    Attributes:
        address: Host and port where it listens.

    Raises:
        ConfigError: It cannot listen there, or everybody could call.

    Example:
        >>> from robolink.journal import memory_journal
        >>> from robolink.serving import CallbackConversation, CallbackLimits, CallbackServer
        >>> journal, limits = memory_journal("server-example"), CallbackLimits()
        >>> server = CallbackServer(
        ...     "127.0.0.1", 0, lambda peer: CallbackConversation(journal, limits, peer=peer)
        ... )
        >>> server.start()
        >>> server.address[0]
        '127.0.0.1'
        >>> server.close()
    """

    def __init__(
        self,
        host: str,
        port: int,
        conversation: Callable[[str], "CallbackConversation"],
        *,
        allow: Collection[str] = (),
        tell: Callable[[str], None] = lambda _sentence: None,
    ) -> None:
        self._allowed = frozenset(_ip(address) for address in allow)
        if not self._allowed and not ipaddress.ip_address(_ip(host)).is_loopback:
            raise ConfigError(
                tr("At {host} any computer on the network could connect.", host=host),
                remedy=tr("Name the allowed computers by address, one by one."),
            )
        self._conversation, self._tell = conversation, tell
        self._lock = threading.Lock()
        self._links: set[socket.socket] = set()
        self._threads: list[threading.Thread] = []
        self._closed = False
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self._listener = socket.create_server((host, port), family=family)
        except OSError as error:
            # Python repeats the address in its own error; the system's error before it has only the
            # cause.
            said = error.__context__ if isinstance(error.__context__, OSError) else error
            raise ConfigError(
                tr(
                    "robolink cannot listen at {host}:{port}: {cause}.",
                    host=host,
                    port=port,
                    cause=said.strerror or said,
                ),
                remedy=tr("Give an address of this computer and another port; 0 is any."),
            ) from error
        self._listener.settimeout(0.2)
        self.address: tuple[str, int] = self._listener.getsockname()[:2]

    def start(self) -> None:
        """Start listening, in a thread of its own."""
        thread = threading.Thread(target=self._listen, name="robolink-serve", daemon=True)
        self._threads.append(thread)
        thread.start()

    def close(self) -> None:
        """Disconnect every program, which then restores what was not kept, and end."""
        self._closed = True
        with self._lock:
            links = tuple(self._links)
        for link in links:
            with suppress(OSError):
                link.shutdown(socket.SHUT_RDWR)
        for thread in tuple(self._threads):
            thread.join(10)
        self._listener.close()

    def _listen(self) -> None:
        trouble = ""
        while not self._closed:
            try:
                link, peer = self._listener.accept()
            except TimeoutError:
                continue
            except OSError as error:
                # Too many open files, or a program that gave up meanwhile: the next one may still
                # connect.
                before, trouble = trouble, str(error.strerror or error)
                if trouble != before:
                    self._say(
                        tr(
                            "No program can connect now: {cause}. robolink tries again "
                            "every second.",
                            cause=trouble,
                        )
                    )
                runtime.sleep(BEAT_S)
                continue
            trouble = ""
            self._receive(link, str(peer[0]))

    def _receive(self, link: socket.socket, peer: str) -> None:
        refusal = self._refusal(peer)
        if refusal:
            self._say(refusal)
            link.close()
            return
        with self._lock:
            self._links.add(link)
        thread = threading.Thread(target=self._talk, args=(link, peer), daemon=True)
        try:
            thread.start()
        except RuntimeError as error:  # the system cannot start another thread now
            self._say(tr("robolink disconnected {peer}: {cause}", peer=peer, cause=error))
            self._end(link)
            return
        self._threads = [one for one in self._threads if one.is_alive()] + [thread]

    def _refusal(self, peer: str) -> str:
        """Return why a program is disconnected unheard; empty if it is admitted."""
        ip = _ip(peer)
        allowed = ip in self._allowed if self._allowed else ipaddress.ip_address(ip).is_loopback
        if not allowed:
            return tr("{peer} may not connect; robolink disconnected it.", peer=peer)
        with self._lock:
            full = len(self._links) >= MOST_PROGRAMS
        if not full:
            return ""
        return tr(
            "robolink disconnected {peer}: {most} programs are connected already, the most "
            "allowed.",
            peer=peer,
            most=MOST_PROGRAMS,
        )

    def _say(self, sentence: str) -> None:
        with suppress(Exception):  # a console that is gone must not end a conversation
            self._tell(sentence)

    def _talk(self, link: socket.socket, peer: str) -> None:
        try:
            with closing(self._conversation(peer)) as conversation:
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                link.settimeout(BEAT_S)
                self._answer_all(link, conversation)
        except RobolinkError as error:
            self._say(tr("robolink disconnected {peer}: {cause}", peer=peer, cause=error))
        except OSError:
            pass  # the program restores the value itself; what is open stays open in the journal
        finally:
            # In any case: a place that is not released would be lost for good.
            self._end(link)

    def _end(self, link: socket.socket) -> None:
        with self._lock:
            self._links.discard(link)
        link.close()

    def _answer_all(self, link: socket.socket, conversation: "CallbackConversation") -> None:
        codec, silent_s = CallbackCodec(), 0.0
        while not (conversation.over or self._closed):
            try:
                data = link.recv(_CHUNK)
            except TimeoutError:
                silent_s += BEAT_S
                conversation.beat()
                if silent_s >= IDLE_S:
                    return
                continue
            if not data:
                return
            silent_s = 0.0
            codec.receive(data)
            while (line := codec.next_event()) is not NEED_DATA:
                link.sendall(encode_line(conversation.answer(line)))


def _ip(text: str) -> str:
    """Return an address in one spelling; an IPv4 address that came over IPv6 is itself."""
    try:
        found = ipaddress.ip_address(text.partition("%")[0])
    except ValueError as error:
        raise ConfigError(
            tr("{address!r} is not the address of a computer.", address=text),
            remedy=tr("Write it in numbers, for example 192.168.0.20."),
        ) from error
    mapped = getattr(found, "ipv4_mapped", None)
    return str(mapped or found)
