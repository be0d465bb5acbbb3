"""What every part of this driver uses: places, their map, and when both are valid.

Whether the PLC is the one of the map: its constant, and the number that it is known by.
"""

from typing import NoReturn, cast

from robolink.controllers.driver_link import DriverLink
from robolink.controllers.plc_map.places import Places
from robolink.controllers.plc_map.registers import RegisterClient, Registers
from robolink.controllers.plc_map.symbol_client import SymbolClient
from robolink.controllers.plc_map.symbols import Symbols
from robolink.errors import (
    NotComparedError,
    NotReadyError,
    NotReadyReason,
    RejectedError,
    RemoteProtocolError,
)
from robolink.messages import tr
from robolink.model import Identity, OutcomeLog
from robolink.register_maps import (
    AnyMap,
    Confirmation,
    MapValue,
    RegisterMap,
    SymbolMap,
    confirmation_of,
)


class MappedPlc(DriverLink):
    """One PLC that is reached through a map.

    Attributes:
        places: The PLC's registers or symbols.
        register_map: Where everything stands.

    Args:
        client: An open client of the kind that the map needs.
        register_map: Where everything stands.
        outcomes: Where doubtful outcomes of this PLC are kept.
        simulated: Whether it is a simulator's address.
    """

    def __init__(
        self,
        client: RegisterClient | SymbolClient,
        register_map: RegisterMap | SymbolMap,
        outcomes: OutcomeLog,
        *,
        simulated: bool,
    ) -> None:
        self._simulated = simulated
        places = self.places = _places_of(client, register_map)
        self.register_map: AnyMap = register_map
        outcomes.ask(self.read_identity)
        super().__init__(client.identity, places.clock, places.latch, outcomes, gate=places.gate)

    @property
    def simulated(self) -> bool:
        """Whether it is a simulator's address; nothing that is read shows it."""
        return self._simulated

    @property
    def permitted(self) -> bool:
        """Whether the machine permits changes now; always if it has no permit."""
        permit = self.register_map.permit
        return permit is None or self.places.is_on(permit)

    def no_motion(self) -> RejectedError:
        """Return the error for anything that would move, stop or switch the machine."""
        return RejectedError(
            tr("robolink neither moves nor stops a PLC with a map."),
            remedy=tr("Do it at the machine; in danger press the emergency stop."),
        )

    def read_identity(self) -> Identity:
        """Return who it is: by its own number, if the map says where that is.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or the number does not stand
                still.
            RejectedError: The PLC has no such place.
        """
        address, place = self.places.identity, f"plc@{self.places.place}"
        number = self.places.own_number()
        if number is None:
            return Identity(place, address, place)
        if not number:
            # A watchdog cleared it, or the program has not started
            # (docs/reference/softmotion.md 4.1).
            return Identity(place, address, place, certain=False)
        return Identity(f"plc:{number}", address, place)

    def who(self) -> Identity:
        """Return which PLC this is: what a person confirms about a map is valid for that one.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or its number does not stand
                still.
            NotReadyError: The map knows where the PLC's number stands, and there is none now.
        """
        found = self.read_identity()
        if found.certain:
            return found
        raise NotReadyError(
            tr(
                "The number that identifies {identity} in the map reads zero.",
                identity=self.identity,
            ),
            reason=NotReadyReason.NOT_REMOTE,
            remedy=tr("Nothing was written. Check that the PLC's program runs, then try again."),
        )

    def require_probe(self) -> None:
        """Compare the PLC's constant with the map's, if there is one.

        Raises:
            RemoteProtocolError: It differs; says what the map should say, if that can be found.
        """
        self.places.require_fit()
        probe = self.register_map.probe
        differs = self.places.require_probe(probe)
        if probe is None or differs is None:
            return
        value, found = differs
        raise RemoteProtocolError(
            tr(
                "The probe at {place} should be {value:g}, but reads {found:g}.",
                place=probe.number.place,
                value=value,
                found=found,
            ),
            remedy=self.places.diagnosis(probe),
        )

    def require_ready(self, tool: int) -> None:
        """Refuse a write if the map is not confirmed, or the machine refuses."""
        self.require_known_place(tool)
        self.require_probe()
        permit = self.register_map.permit
        if permit is not None and not self.places.is_on(permit):
            raise NotReadyError(
                tr("The machine does not permit changes now ({place}).", place=permit.place),
                reason=NotReadyReason.NOT_REMOTE,
                remedy=tr("Nothing was written. Permit them at the machine, then try again."),
            )

    def require_known_place(self, tool: int) -> None:
        """Refuse a change of a tool whose values were never compared; writes nothing.

        Raises:
            NotComparedError: Nobody has, with this map at this PLC.
        """
        confirmation = self._confirmation()
        if confirmation is None or not confirmation.knows_tool(tool):
            self._refuse(tool, tuple(self.register_map.slots[tool].components))

    def require_compared(self, tool: int, components: tuple[str, ...]) -> None:
        """Refuse a change of components that were never compared; writes nothing.

        Args:
            tool: Number of the tool.
            components: Those that would change.

        Raises:
            NotComparedError: One was not, with this map at this PLC.
        """
        confirmation = self._confirmation()
        missing = confirmation.missing(self.register_map) if confirmation is not None else []
        lacking = tuple(name for name in components if MapValue(tool, name) in missing)
        if lacking or confirmation is None:
            self._refuse(tool, lacking or components)

    def _confirmation(self) -> Confirmation | None:
        return confirmation_of(self.who().name, self.register_map)

    def _refuse(self, tool: int, components: tuple[str, ...]) -> NoReturn:
        raise NotComparedError(
            tr(
                "Nobody has compared {values} of the map {name!r} with the screen at {identity}.",
                values=", ".join(f"{tool}.{name}" for name in components),
                name=self.register_map.name,
                identity=self.identity,
            ),
            tool=tool,
            components=components,
            remedy=tr("Nothing was written. Compare them there: robolink expert plc check-map"),
        )


def _places_of(
    client: RegisterClient | SymbolClient, register_map: RegisterMap | SymbolMap
) -> Places:
    if isinstance(register_map, SymbolMap):
        return Symbols(cast(SymbolClient, client), register_map)
    return Registers(cast(RegisterClient, client), register_map)
