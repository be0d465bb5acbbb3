"""sim softmotion: serves a simulated PLC on one or several field buses."""

import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.faults import LinkKind
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.option_text import (
    options_from_text,
    parameters_from_text,
)
from robolink_simulators.softmotion.program.structured_plc import plc_maker

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Secret
from robolink_cli.commands.simulate.service import (
    host_and_port,
    named_values,
    opcua_users,
    world_from,
)
from robolink_cli.commands.simulate.simulated_kind import SimulatedKind, plan_faults
from robolink_cli.options.simulation import DEFAULT_ADDRESS

if TYPE_CHECKING:
    from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace


_MULTICAST: Final = "udp_multicast"


@dataclass(frozen=True, slots=True)
class Buses:
    """Where a PLC is served; nothing at all means Modbus TCP at the usual place.

    Attributes:
        modbus_tcp: HOST:PORT.
        modbus_rtu: ``pty``.
        can: INTERFACE:CHANNEL, with :PORT for udp_multicast.
        opcua: HOST:PORT.
        unit: Number on the serial line.
        node: Number on the CAN bus.
        allow_remote: Whether other machines may reach it.
    """

    modbus_tcp: str | None
    modbus_rtu: str | None
    can: str | None
    opcua: str | None
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
            LinkKind.OPCUA: self.opcua,
        }
        named = frozenset(kind for kind, place in wanted.items() if place is not None)
        return named or frozenset({LinkKind.MODBUS_TCP})


def make_softmotion(
    *,
    kinematics: str,
    parameters: Sequence[str],
    program: Path | None,
    seed: int,
    state: Path | None,
    options: Sequence[str],
    world: Sequence[str],
    faults: Path | None,
    answer_ms: float,
    cell: str = "",
    **placing: Any,  # noqa: ANN401 - other options
) -> SoftMotionSimulator:
    """Make a simulator from the options of ``sim softmotion``, which explain each.

    ``cell`` is its name among several, for what it tells meanwhile.

    Raises:
        ConfigError: One of them makes no sense.
    """
    if ":" in kinematics and str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
    simulator = SoftMotionSimulator(
        kinematics,
        seed=seed,
        parameters=parameters_from_text(named_values(parameters, "--param dArmLength1=250")),
        options=options_from_text(named_values(options, "--option profile=tools")),
        state_path=state,
        world=world_from(world),
        make_plc=plc_maker(program),
        answer_ms=answer_ms,
    )
    plan_faults(simulator, faults, _buses(**placing).kinds, cell=cell)
    return simulator


def _place(
    stack: ExitStack,
    simulator: SoftMotionSimulator,
    clock: ScaledClock,
    *,
    opcua_user: str | None,
    opcua_password_env: str | None,
    **given: Any,  # noqa: ANN401
) -> dict[str, str]:
    users = opcua_users(opcua_user, opcua_password_env)
    return _served(stack, simulator, _buses(**given), clock, users)


def _buses(
    *,
    address: str | None,
    serial: str | None,
    can: str | None,
    opcua: str | None,
    unit: int,
    node: int,
    allow_remote: bool,
    **_making: Any,  # noqa: ANN401 - other options
) -> Buses:
    return Buses(address, serial, can, opcua, unit=unit, node=node, allow_remote=allow_remote)


def _served(
    stack: ExitStack,
    simulator: SoftMotionSimulator,
    buses: Buses,
    clock: ScaledClock,
    users: Mapping[str, Secret],
) -> dict[str, str]:
    """Serve the PLC on each bus; unwanted ones are not imported."""
    urls: dict[str, str] = {}
    address = buses.modbus_tcp
    if buses.kinds == {LinkKind.MODBUS_TCP} and address is None:
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
    if buses.opcua is not None:
        from robolink_simulators.hosting.fieldbus.opcua import serve_opcua

        host, port = host_and_port(buses.opcua, "--opcua")
        opcua = serve_opcua(
            simulator, host, port, clock=clock, users=users, allow_remote=buses.allow_remote
        )
        urls |= stack.enter_context(opcua).urls
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


def _kinematics(simulator: SoftMotionSimulator) -> str:
    return simulator.plc.group.kinematics.name


def _title(simulator: SoftMotionSimulator) -> str:
    return tr(
        "SIMULATED SoftMotion PLC, {kinematics} (seed {seed}). Nothing moves.",
        kinematics=_kinematics(simulator),
        seed=simulator.seed,
    )


SOFTMOTION_KIND: Final = SimulatedKind(
    make_softmotion,
    _place,
    lambda simulator: {"kinematics": _kinematics(simulator)},
    _title,
)
"""The simulator of ``sim softmotion``."""
