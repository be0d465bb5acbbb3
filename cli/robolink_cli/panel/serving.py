"""Serves the panel until it is ended."""

import asyncio
import signal
import socket
import ssl
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import uvicorn

from robolink.errors import ConnectError
from robolink.locale.languages import ENGLISH
from robolink.messages import tr
from robolink_cli.panel.app import Panel
from robolink_cli.panel.board import PanelCell
from robolink_cli.panel.guard.access import Access, Notes, People
from robolink_cli.panel.guard.connections import Connections, listening
from robolink_cli.panel.guard.gate import guarded
from robolink_cli.panel.hub import Hub
from robolink_cli.panel.pages import Pages
from robolink_cli.panel.plant.desk import PlantDesk
from robolink_cli.panel.plant.line_orders import LineOrders
from robolink_cli.panel.stop import StopDesk, StopProcess
from robolink_cli.panel.tastes import Tastes
from robolink_cli.panel.words import speak_several_languages

_LAST_ANSWERS_S: Final = 2
"""How long the end waits for answers that are under way, in s."""


@dataclass(frozen=True, slots=True)
class PanelPlace:
    """Where the panel is served.

    Attributes:
        host: Address or name of this computer.
        port: 0 for any that is free.
        certificate, key: Files of TLS; empty for none.
        name: What a browser calls it; empty for ``host``.
    """

    host: str
    port: int
    certificate: str = ""
    key: str = ""
    name: str = ""

    def context(self, *_: object) -> ssl.SSLContext:
        """Return what TLS takes of the certificate."""
        from robolink_cli.panel.guard.tls import context

        return context(Path(self.certificate), Path(self.key))

    def url(self, port: int) -> str:
        """Return what is opened in a browser."""
        scheme = "https" if self.certificate else "http"
        name = self.name or self.host
        host = f"[{name}]" if ":" in name else name
        return f"{scheme}://{host}:{port}/"


@dataclass(frozen=True, slots=True)
class Served:
    """What a panel shows, and to whom.

    Attributes:
        cells: The cells.
        people: Of each cell the people of the cell file; ``None`` where that names none.
        names: By which names it may be opened, besides its address: those of its certificate.
        audit: Where it is put on record; ``None`` for nowhere.
        groups: The words of each group of the cell files.
        language: Of a tablet that has not chosen one.
        plant: Id of the plant whose plans people carry out here.
    """

    cells: tuple[PanelCell, ...]
    people: Mapping[str, People | None]
    names: Collection[str] = ()
    audit: Notes | None = None
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)
    language: str = ENGLISH
    plant: str = "plant"


async def serve(
    served: Served, place: PanelPlace, *, ready: Callable[[str], None], ended: asyncio.Event
) -> None:
    """Serve the panel until it is ended; then end its jobs in order.

    Args:
        served: What is shown, and to whom.
        place: Where.
        ready: Called with the address once it listens.
        ended: Set when it is to end.

    Raises:
        ConnectError: The address cannot be used.
    """
    speak_several_languages()
    connections, tastes = Connections(), Tastes(served.language)
    with _listening(place, connections) as listener, StopProcess() as carry_out:
        port = int(listener.getsockname()[1])
        access = Access(
            host=place.host,
            port=port,
            tls=bool(place.certificate),
            names=served.names,
            people=served.people,
            audit=served.audit,
            speaking=tastes.speaking,
        )
        access.connections = connections
        # Each has its own thread: what line computers post holds up no halt of an engineer.
        looking, ordering, lines = PlantDesk(), PlantDesk(), PlantDesk()
        note = access.audit.note
        hub = Hub(served.cells, Pages(), access.seats, note, served.groups, plant=served.plant)
        panel = Panel(hub, StopDesk(carry_out), access, tastes, looking=looking, ordering=ordering)
        configured = {cell.name: cell.configured for cell in served.cells}
        orders = LineOrders(lines, configured, served.groups, note)
        config = uvicorn.Config(
            guarded(panel.application(), access, orders),
            lifespan="on",
            log_config=None,
            date_header=False,
            ws="websockets-sansio",
            timeout_graceful_shutdown=_LAST_ANSWERS_S,
            ssl_certfile=place.certificate or None,
            ssl_keyfile=place.key or None,
            ssl_context_factory=place.context if place.certificate else None,
            **access.server_options(),
        )
        server = _Server(config)
        serving = asyncio.ensure_future(server.serve(sockets=[listener]))
        try:
            while not server.started and not serving.done():
                await asyncio.sleep(0.01)
            if not serving.done():
                ready(place.url(port))
                waits = asyncio.ensure_future(ended.wait())
                await asyncio.wait((waits, serving), return_when=asyncio.FIRST_COMPLETED)
                waits.cancel()
        finally:
            server.should_exit = True
            await serving
            access.close()
            for desk in (looking, ordering, lines):
                desk.close()


def _listening(place: PanelPlace, connections: Connections) -> socket.socket:
    try:
        return listening(place.host, place.port, connections)
    except OSError as error:
        raise ConnectError(
            tr(
                "robolink cannot listen at {host}:{port}: {cause}.",
                host=place.host,
                port=place.port,
                cause=error.strerror or error,
            ),
            remedy=tr("Give a free port, for example --listen 127.0.0.1:8421."),
        ) from error


class _Server(uvicorn.Server):
    """A server that leaves the signals of this process to the command."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Capture none."""
        yield


def run(served: Served, place: PanelPlace, ready: Callable[[str], None]) -> None:
    """Serve the panel until SIGTERM or Ctrl-C; the arguments are those of :func:`serve`."""

    async def until_signal() -> None:
        loop, ended = asyncio.get_running_loop(), asyncio.Event()
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            with suppress(NotImplementedError, ValueError, AttributeError):
                loop.add_signal_handler(getattr(signal, name), ended.set)
        await serve(served, place, ready=ready, ended=ended)

    asyncio.run(until_signal())
