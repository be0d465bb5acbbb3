"""What the OPC UA client does when server, channel or connection fail.

Each test asks what was sent as well: nothing is sent twice, and nothing after the end.
"""

import socket
import threading
import time
from collections.abc import Callable
from contextlib import closing

import pytest

from robolink.errors import (
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
)
from robolink.timing import NS_PER_S, SystemClock
from robolink.transport import MailboxLink, open_mailbox_link, open_opcua
from robolink.transport.opcua import errors
from robolink.transport.opcua.mailbox import OpcuaMailboxLink
from tests._rows import each_row
from tests.faults._bending_relay import BendingRelay
from tests.unit._opcua_far_end import FarEnd, symbol

RESPONSE = tuple(range(112))


def through(relay: BendingRelay, kind: str = "softmotion") -> str:
    return f"{kind}+opcua://127.0.0.1:{relay.port}?security=none&write_unsecured=yes"


def hang_up(relay: BendingRelay) -> None:
    relay._ends[0].shutdown(socket.SHUT_RDWR)


def shorten(link: MailboxLink, timeout_s: float) -> None:
    """Let what follows end soon; opening took as long as it liked on a busy computer."""
    assert isinstance(link, OpcuaMailboxLink)
    link._client._timeout_s = timeout_s


class Bends:
    """Counts the messages of a client, and does to answers what it is told."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.answered: Callable[[bytes], bytes] = bytes

    def to_server(self, data: bytes) -> bytes:
        self.sent.append(data[:3])
        return data

    def to_client(self, data: bytes) -> bytes:
        return self.answered(data)

    def relay(self, opcua_served: FarEnd, *, bytewise: bool = False) -> BendingRelay:
        return BendingRelay(
            opcua_served.port, to_server=self.to_server, to_client=self.to_client, bytewise=bytewise
        )


class AheadClock(SystemClock):
    """The machine's clock, which a test moves on."""

    ahead_s = 0.0

    def now_ns(self) -> int:
        return super().now_ns() + int(self.ahead_s * NS_PER_S)


@pytest.mark.parametrize("says", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n"])
def test_a_port_that_is_no_opc_ua_server_is_told_within_one_deadline(says: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        peers = []

        def accept() -> None:
            peer, _ = listening.accept()
            peer.sendall(says)
            peers.append(peer)

        thread = threading.Thread(target=accept)
        thread.start()
        began = time.monotonic()
        expected = RemoteProtocolError if says else ConnectError
        with pytest.raises(expected, match="OPC UA"):
            open_mailbox_link(f"softmotion+opcua://127.0.0.1:{port}?security=none", timeout_s=0.3)
        assert time.monotonic() - began < 2
        thread.join(5)
        for peer in peers:
            peer.close()


def test_nothing_listens_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    with pytest.raises(ConnectError, match="refuses"):
        open_opcua(f"plc+opcua://127.0.0.1:{port}?security=none", timeout_s=1)


def test_a_server_that_falls_silent_times_out_once_and_is_asked_once(opcua_served: FarEnd) -> None:
    bends = Bends()
    with (
        bends.relay(opcua_served) as relay,
        closing(open_mailbox_link(through(relay), timeout_s=3)) as link,
    ):
        shorten(link, 0.2)
        bends.answered, before = lambda data: b"", len(bends.sent)
        began = time.monotonic()
        with pytest.raises(TransportTimeoutError, match=r"write .*heartbeat"):
            link.write_command(range(64))
        assert 0.15 < time.monotonic() - began < 2
        assert len(bends.sent) == before + 1
        with pytest.raises(TransportClosedError):
            link.read_response()
        assert len(bends.sent) == before + 1


def test_a_command_with_its_beat_has_one_deadline(opcua_served: FarEnd) -> None:
    bends, clock = Bends(), AheadClock()
    with (
        bends.relay(opcua_served) as relay,
        closing(open_mailbox_link(through(relay), timeout_s=30, clock=clock)) as link,
    ):
        shorten(link, 10)

        def late_then_silent(data: bytes) -> bytes:
            bends.answered = lambda _: b""
            clock.ahead_s += 9.8
            return data

        bends.answered, before, began_ns = late_then_silent, len(bends.sent), clock.now_ns()
        with pytest.raises(TransportTimeoutError, match=r"write .*command"):
            link.write_command(range(64))
        assert clock.now_ns() - began_ns < 15 * NS_PER_S
        assert len(bends.sent) == before + 2


def test_answers_byte_by_byte_are_whole(opcua_served: FarEnd) -> None:
    with (
        Bends().relay(opcua_served, bytewise=True) as relay,
        closing(open_mailbox_link(through(relay))) as link,
    ):
        assert link.read_response() == RESPONSE


@each_row("place", range(0, 60, 7))
def test_a_damaged_answer_ends_the_link_or_is_the_right_one(
    opcua_served: FarEnd, place: int
) -> None:
    bends = Bends()
    with (
        bends.relay(opcua_served) as relay,
        closing(open_mailbox_link(through(relay), timeout_s=3)) as link,
    ):
        shorten(link, 0.3)

        def bent(data: bytes) -> bytes:
            return data[:place] + bytes([data[place] ^ 0x41]) + data[place + 1 :]

        bends.answered = bent
        try:
            # Without security nothing but the head of a message is held against a bend; the words
            # themselves are under the checksum of the mailbox.
            assert len(link.read_response()) == len(RESPONSE)
        except (RemoteProtocolError, TransportError, RejectedError):
            return


@each_row("torn", [1, 2, 3])
def test_a_response_of_two_cycles_is_read_thrice_at_most_whatever_its_words(
    opcua_served: FarEnd, torn: int
) -> None:
    bends = Bends()
    whole, mixed = [7, *RESPONSE, 7], [7, *RESPONSE, 8]
    with bends.relay(opcua_served) as relay, closing(open_mailbox_link(through(relay))) as link:
        before = len(bends.sent)

        def mended(data: bytes) -> bytes:
            if len(bends.sent) == before + torn:
                opcua_served.put("response", whole)
            return data

        bends.answered = mended
        opcua_served.put("response", mixed)
        try:
            if torn < 3:
                assert link.read_response() == RESPONSE
            else:
                with pytest.raises(RemoteProtocolError, match="two PLC cycles"):
                    link.read_response()
                with pytest.raises(TransportClosedError):
                    link.read_response()
        finally:
            opcua_served.put("response", whole)
        assert len(bends.sent) == before + min(torn + 1, 3)


def test_answers_of_two_cycles_have_one_deadline_together(opcua_served: FarEnd) -> None:
    bends, clock = Bends(), AheadClock()
    with (
        bends.relay(opcua_served) as relay,
        closing(open_mailbox_link(through(relay), timeout_s=30, clock=clock)) as link,
    ):
        before = len(bends.sent)

        def late(data: bytes) -> bytes:
            clock.ahead_s += 20
            return data

        bends.answered = late
        opcua_served.put("response", [7, *RESPONSE, 8])
        try:
            with pytest.raises(TransportTimeoutError):
                link.read_response()
        finally:
            opcua_served.put("response", [7, *RESPONSE, 7])
        assert len(bends.sent) == before + 2


def test_a_connection_that_ended_while_idle_is_noticed_before_anything_is_sent(
    opcua_served: FarEnd,
) -> None:
    bends = Bends()
    with bends.relay(opcua_served) as relay:
        link = open_mailbox_link(through(relay))
        before = len(bends.sent)
        hang_up(relay)
        with pytest.raises(TransportBrokenError, match="closed the connection"):
            link.write_command(range(64))
        assert len(bends.sent) == before
        with closing(link.reopened(timeout_s=3)) as again:
            assert again.read_response() == RESPONSE


def test_a_server_that_hangs_up_in_an_exchange_is_broken_and_not_dialled_again(
    opcua_served: FarEnd,
) -> None:
    bends = Bends()
    with bends.relay(opcua_served) as relay:
        link = open_mailbox_link(through(relay))

        def ending(_data: bytes) -> bytes:
            hang_up(relay)
            return b""

        bends.answered, before = ending, relay.connections
        with pytest.raises(TransportBrokenError):
            link.read_response()
        with pytest.raises(TransportError):
            link.read_response()
        assert relay.connections == before


def test_a_channel_is_renewed_within_a_request_and_no_old_one_used(
    opcua_served: FarEnd,
) -> None:
    bends, clock = Bends(), AheadClock()
    with (
        bends.relay(opcua_served) as relay,
        closing(open_opcua(through(relay, "plc"), clock=clock)) as client,
    ):
        for _ in range(10):  # 48 minutes, in steps that keep the session alive
            clock.ahead_s += 290
            assert client.read([symbol("real")]) == (1.5,)
        assert bends.sent.count(b"OPN") == 2
        assert client.read([symbol("real")]) == (1.5,)
        clock.ahead_s += 301
        before = len(bends.sent)
        with pytest.raises(TransportBrokenError, match="301 s"):
            client.read([symbol("real")])
        assert len(bends.sent) == before


def test_a_close_from_another_thread_ends_a_waiting_exchange(opcua_served: FarEnd) -> None:
    bends = Bends()
    with bends.relay(opcua_served) as relay:
        link = open_mailbox_link(through(relay), timeout_s=20)
        asked = threading.Event()

        def silent(_data: bytes) -> bytes:
            asked.set()
            return b""

        bends.answered = silent
        ended: list[BaseException] = []

        def ask() -> None:
            try:
                link.read_response()
            except TransportError as error:
                ended.append(error)

        thread = threading.Thread(target=ask)
        thread.start()
        assert asked.wait(5)
        link.close()
        thread.join(5)
        assert [type(error) for error in ended] == [TransportClosedError]


def test_two_threads_take_turns(opcua_served: FarEnd) -> None:
    with closing(open_mailbox_link(opcua_served.url())) as link:
        found: list[tuple[int, ...]] = []

        def look() -> None:
            for _ in range(20):
                found.append(link.read_response())

        threads = [threading.Thread(target=look) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(20)
        assert found == [RESPONSE] * 60


def test_a_value_that_the_server_doubts_is_none(opcua_served: FarEnd) -> None:
    with closing(open_opcua(opcua_served.url("plc"))) as client:
        client.describe(symbol("real"))
        opcua_served.put("real", 1.5, "UncertainLastUsableValue")
        try:
            with pytest.raises(RejectedError, match="UncertainLastUsableValue"):
                client.read([symbol("flag"), symbol("real")])
        finally:
            opcua_served.put("real", 1.5)
        assert client.read([symbol("flag"), symbol("real")]) == (False, 1.5)


@each_row(
    ("name", "write", "expected"),
    [
        ("BadTypeMismatch", True, RejectedError),
        ("BadNodeIdUnknown", False, RejectedError),
        ("BadInternalError", True, RemoteProtocolError),
        ("BadDeviceFailure", True, RemoteProtocolError),
        ("UncertainInitialValue", True, RemoteProtocolError),
    ],
)
def test_a_write_that_may_have_been_done_is_no_refusal(
    name: str, write: bool, expected: type[Exception]
) -> None:
    status = errors.ReportedStatus(1, name, "")
    assert type(errors.refused_node("plc", "node", status, write=write)) is expected
    if name.startswith("Bad") and write:
        refused = errors.refused_service("plc", status, "write node", write=True)
        assert type(refused) is expected
