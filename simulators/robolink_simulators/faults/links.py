"""Which fault can happen on which link: a field bus has no login, a serial line no reset."""

from collections.abc import Collection
from enum import StrEnum
from typing import Final

from robolink.messages import tr
from robolink_simulators.faults.fieldbus import PlcFaultAction
from robolink_simulators.faults.stream import FaultAction
from robolink_simulators.not_now import NotNowError

AnyAction = FaultAction | PlcFaultAction


class LinkKind(StrEnum):
    """A way to a simulated controller; the value is the scheme of its URLs."""

    EPSON_TCP = "epson+tcp"
    EPSON_SERIAL = "epson+serial"
    EPSON_SIM = "epson+sim"
    PLC_TCP = "plc+modbus-tcp"
    PLC_RTU = "plc+modbus-rtu"
    PLC_SIM = "plc+sim"
    PLC_OPCUA = "plc+opcua"
    MODBUS_TCP = "softmotion+modbus-tcp"
    MODBUS_RTU = "softmotion+modbus-rtu"
    CAN = "softmotion+can"
    OPCUA = "softmotion+opcua"
    MAILBOX_SIM = "softmotion+sim"


class FaultNotPossibleError(NotNowError):
    """A fault was planned for a link on which it cannot exist.

    Attributes:
        action: The fault.
    """

    def __init__(self, what: str, *, action: AnyAction, remedy: str = "") -> None:
        super().__init__(what, remedy=remedy)
        self.action = action


EPSON_LINKS: Final = frozenset({LinkKind.EPSON_TCP, LinkKind.EPSON_SERIAL, LinkKind.EPSON_SIM})
PLC_LINKS: Final = frozenset(
    {LinkKind.PLC_TCP, LinkKind.PLC_RTU, LinkKind.PLC_OPCUA, LinkKind.PLC_SIM}
)
MAILBOX_LINKS: Final = frozenset(
    {
        LinkKind.MODBUS_TCP,
        LinkKind.MODBUS_RTU,
        LinkKind.CAN,
        LinkKind.OPCUA,
        LinkKind.MAILBOX_SIM,
    }
)
_LINES: Final = frozenset({LinkKind.EPSON_SERIAL, LinkKind.PLC_RTU, LinkKind.MODBUS_RTU})
_STREAMS: Final = EPSON_LINKS | PLC_LINKS
_OPCUA: Final = frozenset({LinkKind.OPCUA, LinkKind.PLC_OPCUA})
_FRAMED: Final = frozenset({LinkKind.MODBUS_TCP, LinkKind.MODBUS_RTU, LinkKind.OPCUA})

_OF_EPSON: Final = frozenset(
    {
        FaultAction.GARBLE_REQUEST,  # PLC frames have a length: half a frame is no request
        FaultAction.TRUNCATE_REQUEST,
        FaultAction.RESTART,
        FaultAction.LOSE_LOGIN,
        FaultAction.TEACH_MODE,
        FaultAction.ESTOP,
        FaultAction.GUARD_OPEN,
        FaultAction.DEVICE_FAULT,
        FaultAction.SERIOUS_ERROR,
    }
)
_OF_CONNECTIONS: Final[frozenset[AnyAction]] = frozenset(
    {
        FaultAction.RESET,
        FaultAction.HALF_OPEN,
        PlcFaultAction.RESET,
        PlcFaultAction.HALF_OPEN,
    }
)
_OF_CAN: Final = frozenset(
    {
        PlcFaultAction.LOSE_SEGMENT,
        PlcFaultAction.WRONG_TOGGLE,
        PlcFaultAction.FOREIGN_NODE,
        PlcFaultAction.ECHO,
    }
)
_OF_MODBUS: Final[frozenset[AnyAction]] = frozenset(
    {FaultAction.MODBUS_EXCEPTION, PlcFaultAction.MODBUS_EXCEPTION}
)
_OF_FRAMES: Final = frozenset(
    {
        PlcFaultAction.MODBUS_EXCEPTION,
        PlcFaultAction.TRUNCATE_REPLY,
        PlcFaultAction.DUPLICATE_REPLY,
        PlcFaultAction.SPLIT_REPLY,
    }
)
OF_OPCUA: Final[frozenset[AnyAction]] = frozenset(
    family[name]
    for family in (FaultAction, PlcFaultAction)
    for name in (
        "TEAR_ARRAY",
        "TEAR_NODES",
        "WRONG_TYPE",
        "SHORT_ARRAY",
        "READ_ONLY",
        "OUT_OF_SERVICE",
        "LOSE_SESSION",
        "DROP_CHANNEL",
        "EXPIRED_CERTIFICATE",
    )
)
"""Faults that each family has for OPC UA; the simulated server itself does them."""

_NOT_ON_CAN: Final = frozenset(
    {
        PlcFaultAction.SHIFT_MAP,
        PlcFaultAction.RESET,
        PlcFaultAction.HALF_OPEN,
    }
)


def links_of(action: AnyAction) -> frozenset[LinkKind]:
    """Return the links on which a fault can happen."""
    if action in OF_OPCUA:
        return _OPCUA & (PLC_LINKS if isinstance(action, FaultAction) else MAILBOX_LINKS)
    if isinstance(action, FaultAction):
        links = EPSON_LINKS if action in _OF_EPSON else _STREAMS
        if action is FaultAction.MODBUS_EXCEPTION:
            links = PLC_LINKS
        if action is FaultAction.TEAR_WRITE:
            links = frozenset({LinkKind.PLC_OPCUA})
        if action is FaultAction.RESTART:
            links |= {LinkKind.PLC_OPCUA}
    elif action in _OF_CAN:
        links = frozenset({LinkKind.CAN})
    elif action in _OF_FRAMES:
        links = _FRAMED
    elif action in _NOT_ON_CAN:
        links = MAILBOX_LINKS - {LinkKind.CAN}
    else:
        links = MAILBOX_LINKS
    if action in _OF_MODBUS or action is PlcFaultAction.SHIFT_MAP:
        links -= _OPCUA  # symbols have names but no neighbours
    return links - _LINES if action in _OF_CONNECTIONS else links


def _namesake_on(served: Collection[LinkKind], action: AnyAction) -> LinkKind | None:
    """Return a served link on which the other family has a fault of that name, if it has one."""
    family = PlcFaultAction if isinstance(action, FaultAction) else FaultAction
    namesake = family.__members__.get(action.name)
    return min(links_of(namesake).intersection(served), default=None) if namesake else None


def require_possible(action: AnyAction, served: Collection[LinkKind]) -> None:
    """Refuse a fault that cannot happen on any of the links that are served.

    Raises:
        FaultNotPossibleError: Names the fault, the links, and those where it could happen.
    """
    links = links_of(action)
    if links.isdisjoint(served) and (there := _namesake_on(served, action)):
        raise FaultNotPossibleError(
            tr(
                "The fault {action} is planned for another kind of link than {links}.",
                action=action.name.lower(),
                links=", ".join(sorted(served)),
            ),
            remedy=tr("Write {example} in the plan.", example=f'link = "{there}"'),
            action=action,
        )
    if links.isdisjoint(served):
        raise FaultNotPossibleError(
            tr(
                "The fault {action} cannot happen on {links}.",
                action=action.name.lower(),
                links=", ".join(sorted(served)),
            ),
            remedy=tr("It can on: {links}.", links=", ".join(sorted(links))),
            action=action,
        )
