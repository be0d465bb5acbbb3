"""Every transport passes the same contract checks, which are kept with the simulators."""

import socket
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

import pytest
from robolink_simulators.checks import LONE_CHECKS, PAIR_CHECKS, LoneMaker, Pair, PairMaker

from robolink.transport import TracingTransport, Transport, open_transport


class SocketFarEnd:
    """The accepting side of a loopback connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def send(self, data: bytes) -> None:
        self._connection.sendall(data)

    def receive_exactly(self, count: int) -> bytes:
        data = bytearray()
        while len(data) < count and (part := self._connection.recv(count - len(data))):
            data += part
        return bytes(data)

    def close(self) -> None:
        self._connection.close()


@contextmanager
def tcp_pair() -> Iterator[Pair]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"epson+tcp://127.0.0.1:{server.getsockname()[1]}"
        with closing(open_transport(url)) as near:
            connection, _ = server.accept()
            connection.settimeout(5.0)
            with connection:
                yield Pair(near, SocketFarEnd(connection))


@contextmanager
def traced_tcp_pair() -> Iterator[Pair]:
    with tcp_pair() as pair:
        yield Pair(TracingTransport(pair.near, lambda time_ns, direction, data: None), pair.far)


@contextmanager
def tcp() -> Iterator[Transport]:
    with tcp_pair() as pair:
        yield pair.near


@contextmanager
def traced_tcp() -> Iterator[Transport]:
    with traced_tcp_pair() as pair:
        yield pair.near


@contextmanager
def simulator() -> Iterator[Transport]:
    with closing(open_transport("epson+sim://transport-contract?seed=1")) as near:
        yield near


@pytest.mark.parametrize("check", LONE_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("make", [tcp, traced_tcp, simulator], ids=lambda make: make.__name__)
def test_a_transport_keeps_the_contract(
    check: Callable[[LoneMaker], None], make: LoneMaker
) -> None:
    check(make)


@pytest.mark.parametrize("check", PAIR_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("make", [tcp_pair, traced_tcp_pair], ids=lambda make: make.__name__)
def test_a_connected_transport_keeps_the_contract(
    check: Callable[[PairMaker], None], make: PairMaker
) -> None:
    check(make)
