"""Every Remote Ethernet command, once (docs/reference/epson.md 1.2, 1.3, 1.8).

Flag names are the field names of ``StatusFlags``. A precondition is judged by the state in
which the request finds the controller; for the commands that are legal during an Execute,
by the state before that Execute began.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum, auto
from types import MappingProxyType
from typing import Final


class VariableType(StrEnum):
    """The types that Remote Ethernet knows, as they are written on the wire."""

    BOOLEAN = "Boolean"
    BYTE = "Byte"
    DOUBLE = "Double"
    INTEGER = "Integer"
    LONG = "Long"
    REAL = "Real"
    STRING = "String"


class ParameterForm(Enum):
    """How the text after the name is cut into parameters.

    ``NUMBERS`` unsigned decimal integers; ``VARIABLE`` a variable name, whose subscripts may
    hold commas, then plain text; ``PASSWORD`` plain text up to a comma; ``STATEMENT`` one text
    between the first and the last quote. What a device does with more of them than a command
    takes is said in ``_messages``.
    """

    NUMBERS = auto()
    VARIABLE = auto()
    PASSWORD = auto()
    STATEMENT = auto()


class ReplyShape(Enum):
    """What follows the name in a successful reply.

    ``NONE`` a lone ``0``; ``FIELDS`` values between commas; ``TEXT`` a quoted text, or ``0``
    when the statement printed nothing.
    """

    NONE = auto()
    FIELDS = auto()
    TEXT = auto()


@dataclass(frozen=True, slots=True)
class RemoteCommand:
    """What one command demands and gives.

    Attributes:
        name: Canonical spelling; any case is accepted on the wire.
        min_parameters: Fewest parameters.
        max_parameters: Most parameters.
        needs: Status flags that must be on.
        forbids: Status flags that must be off.
        form: How its parameters are written.
        reply: What a successful reply carries.
        in_monitoring: Served to a client that may only monitor (docs/reference/epson.md 1.3).
        during_execute: RC+ version from which it is served while an Execute runs.
        since: RC+ version that introduced it.
        extended: Not in the public command table; older firmware answers 11
            (docs/reference/epson.md 1.8).
        bare: Clients send it without its parameter too (docs/reference/epson.md 1.10); a device
            decides what that means.
    """

    name: str
    min_parameters: int = 0
    max_parameters: int = 0
    needs: frozenset[str] = frozenset()
    forbids: frozenset[str] = frozenset()
    form: ParameterForm = ParameterForm.NUMBERS
    reply: ReplyShape = ReplyShape.NONE
    in_monitoring: bool = False
    during_execute: int | None = None
    since: int = 5
    extended: bool = False
    bare: bool = False

    def allowed_during_execute(self, rc_plus: int) -> bool:
        """Return whether RC+ version ``rc_plus`` serves it while an Execute runs."""
        return self.during_execute is not None and rc_plus >= self.during_execute


_AUTO: Final = frozenset({"auto"})
_READY: Final = frozenset({"auto", "ready"})
# The manual's table does not list Auto here (docs/reference/epson.md 1.2, note 2).
_READY_ONLY: Final = frozenset({"ready"})
_UNSAFE: Final = frozenset({"emergency_stop", "safeguard"})
# One manual prints "Safeguard on" for Start; the guard must be closed (docs/reference/epson.md 1.2
# note 1).
_UNFIT: Final = _UNSAFE | {"error"}


def _query(name: str, parameters: int = 0, *, during_execute: int | None = None) -> RemoteCommand:
    return RemoteCommand(
        name,
        parameters,
        parameters,
        reply=ReplyShape.FIELDS,
        in_monitoring=True,
        during_execute=during_execute,
    )


def _output(name: str, needs: frozenset[str]) -> RemoteCommand:
    return RemoteCommand(name, 2, 2, needs, during_execute=7)


def _extended(name: str, parameters: int = 0) -> RemoteCommand:
    return RemoteCommand(
        name,
        parameters,
        parameters,
        reply=ReplyShape.FIELDS,
        in_monitoring=True,
        since=7,
        extended=True,
    )


_VARIABLE: Final = ParameterForm.VARIABLE
_STATEMENT: Final = ParameterForm.STATEMENT

COMMANDS: Final[tuple[RemoteCommand, ...]] = (
    RemoteCommand("Login", 1, 1, form=ParameterForm.PASSWORD, in_monitoring=True, bare=True),
    RemoteCommand("Logout", in_monitoring=True),
    RemoteCommand("Start", 1, 1, _READY, _UNFIT),
    RemoteCommand("Stop", needs=_AUTO),
    RemoteCommand("Pause", needs=frozenset({"auto", "running"})),
    RemoteCommand("Continue", needs=frozenset({"auto", "paused"})),
    RemoteCommand("Reset", needs=_READY),
    RemoteCommand("SetMotorsOn", 1, 1, _READY, _UNSAFE, bare=True),
    RemoteCommand("SetMotorsOff", 1, 1, _READY, bare=True),
    RemoteCommand("SetCurRobot", 1, 1, _READY),
    _query("GetCurRobot"),
    RemoteCommand("Home", 1, 1, _READY, _UNFIT, bare=True),
    _query("GetIO", 1),
    _query("GetMemIO", 1),
    _output("SetIO", _READY_ONLY),
    _output("SetMemIO", _READY),
    _query("GetIOByte", 1),
    _query("GetMemIOByte", 1),
    _output("SetIOByte", _READY_ONLY),
    _output("SetMemIOByte", _READY),
    _query("GetIOWord", 1),
    _query("GetMemIOWord", 1),
    _output("SetIOWord", _READY),
    _output("SetMemIOWord", _READY),
    RemoteCommand("GetVariable", 1, 3, form=_VARIABLE, reply=ReplyShape.FIELDS, in_monitoring=True),
    RemoteCommand("SetVariable", 2, 3, _READY, form=_VARIABLE),
    _query("GetStatus", during_execute=5),
    RemoteCommand("Execute", 1, 1, _READY, _UNFIT, form=_STATEMENT, reply=ReplyShape.TEXT),
    RemoteCommand("Abort", needs=_AUTO, during_execute=5),
    RemoteCommand("GetAlm", reply=ReplyShape.FIELDS, in_monitoring=True, since=7),
    # Its preconditions are not documented; any remote command requires Auto.
    RemoteCommand("ResetAlm", 1, 1, _AUTO, since=7),
    _extended("GetContName"),
    _extended("GetContNo"),
    _extended("GetContVer"),
    _extended("GetContType"),
    _extended("GetContDev"),
    _extended("GetSubnetMask"),
    _extended("GetDefaultGateway"),
    _extended("GetContMacAdd"),
    _extended("GetPrjName"),
    _extended("GetCpuLoad"),
    _extended("GetContSettings"),
    _extended("GetCameraModel"),
    _extended("GetForceSerial"),
    _extended("GetRobotInfo"),
    _extended("GetRobotName", 1),
    _extended("GetRobotSerial", 1),
    _extended("GetMotor", 1),
    _extended("GetHofs", 1),
    _extended("GetErrMsg", 2),
    _extended("GetErrFunc", 1),
    _extended("GetHealthCont"),
    _extended("GetHealthRB", 3),
    _extended("GetPartWarning", 1),
)
"""Table of the commands, in the order of docs/reference/epson.md 1.2, then 1.8."""

_BY_NAME: Final[Mapping[str, RemoteCommand]] = MappingProxyType(
    {command.name.lower(): command for command in COMMANDS}
)


def find_command(name: str) -> RemoteCommand | None:
    """Return the command called ``name`` in any case, ``None`` when there is none."""
    # The Kelvin sign and similar characters become ASCII letters in lower case, but are no names.
    return _BY_NAME.get(name.lower()) if name.isascii() else None
