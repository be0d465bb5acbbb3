"""sim softmotion: serving a simulated PLC on one or several field buses."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink_simulators.assist.port import serve_assist
from robolink_simulators.cell.clock import ScaledClock, SteeredClock
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.faults import LinkKind
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.commands.simulate.serving import (
    Termination,
    announce,
    controlled,
    host_and_port,
)
from robolink_cli.options.simulation import DEFAULT_ADDRESS, ServedLife

if TYPE_CHECKING:
    from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace

_PTY: Final = "pty"
_MULTICAST: Final = "udp_multicast"


@dataclass(frozen=True, slots=True)
class Buses:
    """Where a PLC is served; nothing at all means Modbus TCP at the usual place.

    Attributes:
        modbus_tcp: HOST:PORT.
        modbus_rtu: ``pty``.
        can: INTERFACE:CHANNEL, with :PORT for udp_multicast.
        unit: Number on the serial line.
        node: Number on the CAN bus.
        allow_remote: Whether other machines may reach it.
    """

    modbus_tcp: str | None
    modbus_rtu: str | None
    can: str | None
    unit: int
    node: int
    allow_remote: bool

    @property
    def kinds(self) -> frozenset[LinkKind]:
        """The links that it is served on."""
        wanted = {
            LinkKind.MODBUS_TCP: self.modbus_tcp,
            LinkKind.MODBUS_RTU: self.modbus_rtu,
            LinkKind.CAN: self.can,
        }
        named = frozenset(kind for kind, place in wanted.items() if place is not None)
        return named or frozenset({LinkKind.MODBUS_TCP})


def serve_plc(
    simulator: SoftMotionSimulator, buses: Buses, *, speed: float, life: ServedLife
) -> None:
    """Serve a simulator, its assist port and its control API until SIGTERM or Ctrl-C."""
    clock = SteeredClock(speed)
    with ExitStack() as stack:
        stopped = stack.enter_context(Termination(life))
        urls = _served(stack, simulator, buses, clock)
        assist = stack.enter_context(serve_assist(simulator, clock=clock))
        cells = {"cell": ControlledCell(simulator, clock, urls)}
        control = stack.enter_context(controlled(cells, life, allow_remote=buses.allow_remote))
        beside = {"assist": assist.url, "control": control.url_of("cell")}
        _announce(simulator, urls, beside, stopped.state_dir)
        stopped.wait(lambda: simulator.log.added + control.requests)


def _served(
    stack: ExitStack, simulator: SoftMotionSimulator, buses: Buses, clock: ScaledClock
) -> dict[str, str]:
    """Put the PLC on each bus; what is not wanted is not imported."""
    urls: dict[str, str] = {}
    address = buses.modbus_tcp
    if address is None and buses.modbus_rtu is None and buses.can is None:
        address = DEFAULT_ADDRESS
    if address is not None:
        from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp

        host, port = host_and_port(address, "--tcp")
        tcp = serve_modbus_tcp(simulator, host, port, clock=clock, allow_remote=buses.allow_remote)
        urls["modbus-tcp"] = stack.enter_context(tcp).url
    if buses.modbus_rtu is not None:
        from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu

        rtu = serve_modbus_rtu(simulator, unit=buses.unit, clock=clock)
        urls["modbus-rtu"] = stack.enter_context(rtu).url
    if buses.can is not None:
        from robolink_simulators.hosting.fieldbus.canopen_node import serve_canopen

        can = serve_canopen(simulator, _can_place(buses.can, buses.node), clock=clock)
        urls["can"] = stack.enter_context(can).url
    return urls


def _can_place(text: str, node: int) -> "CanPlace":
    from robolink_simulators.hosting.fieldbus.canopen_node import MULTICAST_PORT, CanPlace

    interface, _, channel = text.partition(":")
    port = str(MULTICAST_PORT)
    if interface == _MULTICAST and ":" in channel:
        channel, _, port = channel.rpartition(":")
    if not (
        interface
        and channel
        and port.isascii()
        and port.isdigit()
        and len(port) <= 5
        and int(port) <= 0xFFFF
    ):
        raise ConfigError(
            tr("{text!r} names no CAN bus.", text=text),
            remedy=tr("Write for example --can udp_multicast:239.74.163.2:43113."),
        )
    return CanPlace(interface, channel, int(port), node)


def _announce(
    simulator: SoftMotionSimulator,
    urls: Mapping[str, str],
    beside: Mapping[str, str],
    state_dir: str,
) -> None:
    kinematics = simulator.plc.group.kinematics.name
    document: dict[str, object] = {
        "url": simulator.url,
        "urls": dict(urls),
        **beside,
        "kinematics": kinematics,
        "seed": simulator.seed,
    }
    lines: Sequence[str] = (
        tr(
            "SIMULATED SoftMotion PLC, {kinematics} (seed {seed}). Nothing moves.",
            kinematics=kinematics,
            seed=simulator.seed,
        ),
        *(tr("  {bus}  {url}", bus=bus.ljust(10), url=url) for bus, url in urls.items()),
        tr("  assist      {url}", url=beside["assist"]),
        tr("  control     {url}", url=beside["control"]),
        tr('Try: robolink -c "{url}" status', url=simulator.url),
        tr("From the tip to the pin, seen now: robolink sim assist ASSIST look"),
        tr("Ctrl-C ends it."),
    )
    announce(document, lines, state_dir)
