"""A client without a socket, for tests of the simulated EPSON controller."""

from collections.abc import Callable, Iterator

import pytest
from robolink_simulators.epson import EpsonSimulator

from tests.unit._mailbox_programs import mailbox_program as mailbox_program
from tests.unit._mailbox_programs import offer_programs
from tests.unit._opcua_far_end import FarEnd, far_end

S = 1_000_000_000


class Client:
    """One link to a simulator, with the test's own time."""

    def __init__(self, simulator: EpsonSimulator, now_ns: int = 0) -> None:
        self.simulator = simulator
        self.link = simulator.connect(max(now_ns, simulator.now_ns))

    def send(self, request: str) -> None:
        """Send a request at the present time, without taking an answer."""
        self.link.receive(f"{request}\r\n".encode(), self.simulator.now_ns)

    def ask(self, request: str) -> str:
        """Send a request and return the immediate answer without its terminator."""
        self.send(request)
        return self.heard()

    def heard(self) -> str:
        """Return the available answers, without the last terminator."""
        return self.link.outgoing().decode().removesuffix("\n").removesuffix("\r")

    def wait(self, seconds: float) -> str:
        """Let time pass, then return the available answers."""
        self.simulator.advance(self.simulator.now_ns + round(seconds * S))
        return self.heard()

    def flags(self) -> str:
        """Return the flags of GetStatus."""
        return self.ask("$GetStatus").split(",")[1]

    def code(self) -> int:
        """Return the error number of GetStatus."""
        return int(self.ask("$GetStatus").split(",")[2])


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Parametrize tests of more than one module."""
    offer_programs(metafunc)


@pytest.fixture(scope="session")
def opcua_served() -> Iterator[FarEnd]:
    """Serve a mailbox over OPC UA; one for all, because asyncua's address space takes long."""
    with far_end() as one:
        yield one


@pytest.fixture
def connect() -> Callable[[EpsonSimulator], Client]:
    """Connect to a simulator without logging in."""
    return Client


@pytest.fixture
def login() -> Callable[..., Client]:
    """Connect to a simulator and log in."""

    def logged_in(simulator: EpsonSimulator, password: str = "") -> Client:
        client = Client(simulator)
        assert client.ask(f"$Login,{password}") == "#Login,0"
        return client

    return logged_in
