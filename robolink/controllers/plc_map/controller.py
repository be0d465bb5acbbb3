"""A PLC that keeps tool offsets in registers or symbols of its own, and opening one.

The inputs that a map names.

Where the flange is, from a PLC that tells it; a person moves.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Final, NoReturn

from robolink.controllers.controller_core import ControllerCore
from robolink.controllers.driver_link import DriverPart
from robolink.controllers.motion_group import MotionGroupCore
from robolink.controllers.plc_map.link import MappedPlc
from robolink.controllers.plc_map.registers import RegisterClient
from robolink.controllers.plc_map.slots import OffsetValues
from robolink.controllers.plc_map.symbol_client import SymbolClient
from robolink.controllers.plc_map.tools import RegisterResolver, RegisterToolTable
from robolink.controllers.preserving import Preserver
from robolink.controllers.registry import ConnectionTerms
from robolink.errors import Concerning, ConfigError, RejectedError
from robolink.messages import known_names, tr
from robolink.model import (
    Act,
    Capabilities,
    Controller,
    ControllerFacts,
    ControllerStatus,
    Identity,
    OutcomeLog,
    Pose,
    Secret,
)
from robolink.register_maps import AnyMap, RegisterMap, SymbolMap, load_map, load_symbol_map
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import AnswerTimes, Clock
from robolink.transport import LinkUrl, open_modbus, open_opcua

if TYPE_CHECKING:  # pyright does not accept a cached_property as a property of Controller
    from builtins import property as cached_property
else:
    from functools import cached_property


class MappedInputs(DriverPart):
    """Reads inputs by the number that the map gives them."""

    def __init__(self, plc: MappedPlc) -> None:
        super().__init__(plc)
        self._places = plc.places
        self._inputs = plc.register_map.inputs

    def names(self) -> dict[int, str]:
        """Return the inputs of the map and what people call them."""
        return {number: one.name for number, one in self._inputs.items()}

    def read_input(self, bit: int) -> bool:
        """Read one input.

        Raises:
            ConfigError: The map has no such input.
        """
        if bit not in self._inputs:
            raise ConfigError(
                tr("The map has no input {number}.", number=bit),
                remedy=known_names(self._inputs),
            )
        return self._places.is_on(self._inputs[bit].signal)

    def set_output(self, bit: int, on: bool) -> NoReturn:  # noqa: ARG002 - the model's form
        """Refuse: a map has no outputs.

        Raises:
            RejectedError: Always.
        """
        raise RejectedError(
            tr("Output {number} was not switched: a PLC map has no outputs.", number=bit),
            remedy=tr("Switch it at the machine."),
        )

    def preview_output(self, bit: int, on: bool) -> NoReturn:
        """Refuse; see :meth:`set_output`."""
        self.set_output(bit, on)


_FAR_MM: Final = 100_000.0
_FAR_DEG: Final = 36_000.0
"""Largest plausible distance, in mm, and turn, in degrees, of a head."""

_SYMBOLS: Final = "opcua"
"""Medium whose maps name symbols; those of all others name registers."""

_IN_PROCESS: Final = "sim"
"""Medium of a simulator in this process; its tools are lost when the process ends."""


class FlangeReader(MotionGroupCore):
    """The axis group of a PLC with a map: it may report its place, and is never moved."""

    def __init__(self, plc: MappedPlc) -> None:
        super().__init__(plc)
        self._plc = plc
        self._places = plc.places
        self._flange = plc.register_map.flange
        self._name = plc.register_map.name
        self._values = OffsetValues(plc.register_map)

    @property
    def name(self) -> str:
        """What the map calls the machine."""
        return self._name

    def pose(self) -> Pose:
        """Read where the flange is now.

        Raises:
            RejectedError: The map has no ``[flange]``.
        """
        if not self._flange:
            raise RejectedError(
                tr("This PLC does not report where the flange is."),
                remedy=tr(
                    "Read the poses at the HMI and give them with {poses}; or add [flange] to the "
                    "map, if the PLC tells it.",
                    poses=remedy_word(RemedyWord.GIVEN_POSES),
                ),
            )
        cells = self._places.stable(self._flange)
        pose = self._values.numbers(self._flange, cells, largest_mm=_FAR_MM, largest_deg=_FAR_DEG)
        return Pose(*pose, tool=0)

    def move_to(self, *_asked: object, **_how: object) -> NoReturn:
        """Refuse, like everything that would move or stop the machine.

        Raises:
            RejectedError: Always.
        """
        raise self._plc.no_motion()

    def require_able(self, purpose: str) -> NoReturn:
        """Refuse, as :meth:`move_to` does."""
        self.move_to(purpose)

    move_until_input = requests_until = requests_for = obstacle = terms = stop = move_to
    deceleration_mm_s2 = run_up_mm = edge_step_mm = move_to


class PlcMapController(ControllerCore):
    """A PLC that is reached through a map. Use it as a context manager.

    It moves nothing: a calibration takes its poses from a person.

    Attributes:
        register_map: Where everything stands.
        tools: The tools of the map.
        groups: One, which tells where the flange is, if the map has that, and refuses to move.

    Args:
        client: An open client, of Modbus for a map of registers, of OPC UA for one of symbols; the
            controller owns it from here on.
        register_map: The map.
        outcomes: Where doubtful outcomes of this PLC are kept.
        simulated: Whether it is a simulator's address; nothing that is read tells that.

    Example:
        >>> from pathlib import Path
        >>> from robolink.controllers import PlcMapController
        >>> from robolink.journal import memory_journal
        >>> from robolink.register_maps import load_map
        >>> from robolink.transport import open_modbus
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> register_map, log = load_map(path), memory_journal("map-example").log("map-example")
        >>> with serve_plc(PlcSimulator(register_map, seed=1), path) as host:
        ...     client = open_modbus(host.url.partition("&map")[0])
        ...     with PlcMapController(client, register_map, log) as controller:
        ...         list(controller.tools.indices())
        [1, 2]
    """

    OF_KIND: ClassVar = Capabilities(tool_write=True, inputs_only=True, io=True)
    tools: RegisterToolTable
    groups: tuple[FlangeReader]

    def __init__(
        self,
        client: RegisterClient | SymbolClient,
        register_map: RegisterMap | SymbolMap,
        outcomes: OutcomeLog,
        *,
        simulated: bool = False,
    ) -> None:
        plc = self._plc = MappedPlc(client, register_map, outcomes, simulated=simulated)
        self.register_map: AnyMap = register_map
        self.groups = (FlangeReader(plc),)
        able = replace(self.OF_KIND, tool_write=register_map.writable)
        super().__init__(plc, capabilities=able, tools=RegisterToolTable(plc))

    @cached_property
    def io(self) -> MappedInputs:
        """The inputs that the map names."""
        return MappedInputs(self._plc)

    @cached_property
    def resolver(self) -> RegisterResolver:
        """Finishes or undoes interrupted jobs."""
        return RegisterResolver(self._plc, self.tools, self._preserver)

    @cached_property
    def _preserver(self) -> Preserver:
        return _KeepsOthersOut(self._plc, self.tools)

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._plc.places.exchanges

    @property
    def answers(self) -> AnswerTimes:
        """How long it takes to answer."""
        return self._plc.places.answers

    def who(self) -> Identity:
        """Return which PLC this is: what a person confirms about a map is valid for that one.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or its number does not stand
                still.
            NotReadyError: The map knows where the PLC's number stands, and there is none now.
        """
        return self._plc.who()

    def require_probe(self) -> None:
        """Compare the PLC's constant with the map's, if there is one.

        Raises:
            RemoteProtocolError: It differs; says what the map should say.
        """
        self._plc.require_probe()

    def facts(self) -> ControllerFacts:
        """Return what the map says about the machine; its PLC reports nothing."""
        return ControllerFacts(controller_name=self.register_map.name)

    def error_text(self, code: int) -> str:
        """Return the map's text for an error number, empty if it has none."""
        return self.tools.handshake.error_text(code)

    def condition(self) -> dict[str, object]:
        """Read the selected tool, and the text of an error, as far as the map has them.

        ``simulated`` stands there for a simulator's address alone: without it nothing is known.
        """
        fault = self.tools.handshake.fault()
        return {
            "text": self.error_text(fault) if fault else "",
            "selected_tool": self.tools.selected() if self.register_map.selected else None,
            "map": self.register_map.name,
            "permitted": self._plc.permitted,
            **({"simulated": True} if self._plc.simulated else {}),
        }

    def preview(self, act: Act) -> tuple[str, ...]:  # noqa: ARG002 - the model's form
        """Refuse; see :meth:`stop`."""
        raise self._plc.no_motion()

    def stop(self) -> None:
        """Write nothing from here on; robolink cannot stop the machine itself.

        Raises:
            RejectedError: Always; the message says to use the emergency stop.
        """
        self.latch.close()
        raise self._plc.no_motion()

    def reset_fault(self) -> None:
        """Refuse; see :meth:`stop`."""
        raise self._plc.no_motion()

    def motors(self, on: bool) -> None:  # noqa: ARG002 - the model's form
        """Refuse; see :meth:`stop`."""
        raise self._plc.no_motion()

    def _read_status(self) -> ControllerStatus:
        """Read permit, busy and error; one that the map lacks never blocks.

        An answer shows that the PLC is alive.
        """
        slot = next(iter(self.register_map.slots.values()))
        self._plc.places.once(slot.components)
        fault, busy = self.tools.handshake.fault(), self.tools.handshake.is_busy()
        return ControllerStatus(
            remote=self._plc.permitted,
            ready=fault is None and not busy,
            running=busy,
            fault=fault is not None,
            code=fault or 0,
        )

    def _close_link(self) -> None:
        self._plc.places.close()


class _KeepsOthersOut(Preserver):
    """Nothing is selected or moved here, so nothing has to be restored."""

    def _in_force(self, reason: str) -> None:  # noqa: ARG002 - alike for all
        return None


def open_plc_map_url(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect to the PLC at a URL; see :class:`~robolink.controllers.ControllerOpener`.

    Raises:
        RobolinkError: As :func:`open_plc_map`.
    """
    record = partial(terms.record_at, durable=url.medium != _IN_PROCESS)
    return open_plc_map(
        url,
        outcomes=record,
        timeout_s=terms.timeout_s,
        clock=terms.clock,
        password=terms.password,
    )


def open_plc_map(
    url: LinkUrl,
    *,
    outcomes: Callable[[str], OutcomeLog],
    timeout_s: float = 3.0,
    clock: Clock | None = None,
    compare_probe: bool = True,
    password: Secret | None = None,
) -> PlcMapController:
    """Open ``plc+modbus-tcp://host?map=machine.toml`` and compare the probe, if there is one.

    The map of ``plc+opcua://host`` names symbols; types and lengths are compared, too.

    Args:
        url: ``map`` names the map, seen from the working folder, ``simulated=yes`` stands in the
            address of a simulator; the other options are those of a Modbus client
            (docs/reference/mailbox.md) or of an OPC UA client.
        outcomes: Opens the record of the PLC whose identity it is given.
        timeout_s: Longest wait for the connection, and for each answer.
        clock: Replaces the machine's clock.
        compare_probe: Whether to; what looks at a map that is not right yet does without.
        password: Of the user whom an OPC UA URL names.

    Raises:
        ConfigError: The URL, an option or the map is wrong.
        ConnectError: No connection.
        RemoteProtocolError: The probe differs, and what the map should say; or a node does.

    Example:
        >>> from pathlib import Path
        >>> from robolink.controllers import open_plc_map
        >>> from robolink.journal import memory_journal
        >>> from robolink.register_maps import load_map
        >>> from robolink.transport import parse_url
        >>> from robolink_simulators.plc import PlcSimulator, serve_plc
        >>> from robolink_simulators.testkit.operator import written_map
        >>> path = written_map(Path.cwd())
        >>> def record(identity):
        ...     return memory_journal(identity).log(identity)
        >>> with serve_plc(PlcSimulator(load_map(path), seed=1), path) as host:
        ...     with open_plc_map(parse_url(host.url), outcomes=record) as controller:
        ...         controller.register_map.name
        'simulated dispenser'
    """
    register_map, url, simulated = _with_map(url)
    client: RegisterClient | SymbolClient
    if url.medium == _SYMBOLS:
        client = open_opcua(url, timeout_s=timeout_s, clock=clock, password=password)
    else:
        client = open_modbus(url, timeout_s=timeout_s, clock=clock)
    try:
        with Concerning(client.identity):
            controller = PlcMapController(
                client, register_map, outcomes(client.identity), simulated=simulated
            )
    except BaseException:
        client.close()
        raise
    try:
        if compare_probe:
            controller.require_probe()
    except BaseException:
        controller.close()
        raise
    return controller


def _with_map(url: LinkUrl) -> tuple[RegisterMap | SymbolMap, LinkUrl, bool]:
    """Return the map that a URL names, the URL of the client, and whether it is a simulator's."""
    options = dict(url.options)
    file, said = options.pop("map", ""), options.pop("simulated", None)
    if not file:
        raise ConfigError(
            tr("The option {name} is missing in the {scheme} URL.", name="map", scheme=url.scheme),
            remedy=tr(
                "Write for example {scheme}://192.168.0.2?map=machine.toml.", scheme=url.scheme
            ),
        )
    if said is not None:
        _require_simulator(url, said)
    simulated = said is not None or url.medium == _IN_PROCESS
    load = load_symbol_map if url.medium == _SYMBOLS else load_map
    return load(Path(file).expanduser()), replace(url, options=options), simulated


def _require_simulator(url: LinkUrl, said: str) -> None:
    """Refuse the mark of a simulator if a machine could be behind the address.

    Raises:
        ConfigError: It leads out of this computer, or the sign is another than ``yes``.
    """
    if said != "yes" or not url.stays_here:
        raise ConfigError(
            tr("The option simulated=yes is only for a simulator on this computer."),
            remedy=tr("Nothing was sent. Remove it from the address of a machine."),
        )
