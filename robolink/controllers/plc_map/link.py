"""What every part of this driver works with: registers, the map of them, and when both count."""

from typing import NoReturn

from robolink.controllers.driver_link import DriverLink
from robolink.controllers.plc_map.probe import MapIdentityReader, require_probe
from robolink.controllers.plc_map.registers import RegisterClient, Registers
from robolink.errors import NotComparedError, NotReadyError, NotReadyReason, RejectedError
from robolink.messages import tr
from robolink.model import Identity, OutcomeLog
from robolink.register_maps import Confirmation, MapValue, RegisterMap, confirmation_of


class MappedPlc(DriverLink):
    """One PLC that is reached by a map.

    Attributes:
        registers: The PLC's tables.
        register_map: Where everything stands.

    Args:
        client: An open Modbus client.
        register_map: Where everything stands.
        outcomes: Where doubtful outcomes of this PLC are kept.
        simulated: Whether it is a simulator's address.
    """

    def __init__(
        self,
        client: RegisterClient,
        register_map: RegisterMap,
        outcomes: OutcomeLog,
        *,
        simulated: bool,
    ) -> None:
        self._simulated = simulated
        registers = self.registers = Registers(client)
        self.register_map = register_map
        self._identity = MapIdentityReader(registers, register_map)
        outcomes.ask(self._identity.read)
        super().__init__(
            client.identity, registers.clock, registers.latch, outcomes, gate=registers.gate
        )

    @property
    def simulated(self) -> bool:
        """Whether it is a simulator's address; the registers of a machine say nothing of it."""
        return self._simulated

    @property
    def permitted(self) -> bool:
        """Whether the machine permits changes now; one without a permit always does."""
        permit = self.register_map.permit
        return permit is None or self.registers.is_on(permit)

    def no_motion(self) -> RejectedError:
        """Return the error for anything that would move, stop or switch the machine."""
        return RejectedError(
            tr("A PLC with a register map is neither moved nor stopped by robolink."),
            remedy=tr("Do it at the machine; in danger press the emergency stop."),
            controller=self.identity,
        )

    def who(self) -> Identity:
        """Return which PLC this is: what a person confirms about a map holds for that one.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or its number does not stand
                still.
            NotReadyError: The map knows where the PLC's number stands, and there is none now.
        """
        found = self._identity.read()
        if found.certain:
            return found
        raise NotReadyError(
            tr(
                "The number that identifies {identity} in the map reads zero.",
                identity=self.identity,
            ),
            reason=NotReadyReason.NOT_REMOTE,
            remedy=tr("Check that the PLC's program runs, then try again; nothing was written."),
            controller=self.identity,
        )

    def require_probe(self) -> None:
        """Compare the PLC's constant with the map's, if there is one.

        Raises:
            RemoteProtocolError: It differs; says what the map should say.
        """
        require_probe(self.registers, self.register_map.probe)

    def require_ready(self, tool: int, request: str) -> None:
        """Refuse a write where the map is not known to be right, or the machine says no."""
        self.require_known_place(tool, request)
        self.require_probe()
        permit = self.register_map.permit
        if permit is not None and not self.registers.is_on(permit):
            raise NotReadyError(
                tr("The machine does not permit changes now ({place}).", place=permit.place),
                reason=NotReadyReason.NOT_REMOTE,
                remedy=tr("Permit it at the machine, then try again; nothing was written."),
                controller=self.identity,
                request=request,
            )

    def require_known_place(self, tool: int, request: str) -> None:
        """Refuse a change of a tool of which nobody has compared anything; writes nothing.

        Raises:
            NotComparedError: Nobody has, with this map at this PLC.
        """
        confirmation = self._confirmation()
        if confirmation is None or not confirmation.knows_tool(tool):
            self._refuse(tool, tuple(self.register_map.slots[tool].components), request)

    def require_compared(self, tool: int, components: tuple[str, ...], request: str) -> None:
        """Refuse a change of components that nobody has compared; writes nothing.

        Args:
            tool: Number of the tool.
            components: Those that would change.
            request: What would be written, for a person.

        Raises:
            NotComparedError: One was not, with this map at this PLC.
        """
        confirmation = self._confirmation()
        missing = confirmation.missing(self.register_map) if confirmation is not None else []
        lacking = tuple(name for name in components if MapValue(tool, name) in missing)
        if lacking or confirmation is None:
            self._refuse(tool, lacking or components, request)

    def _confirmation(self) -> Confirmation | None:
        return confirmation_of(self.who().name, self.register_map)

    def _refuse(self, tool: int, components: tuple[str, ...], request: str) -> NoReturn:
        raise NotComparedError(
            tr(
                "Nobody has compared {values} of the map {name!r} with the screen of the machine "
                "at {identity} yet.",
                values=", ".join(f"{tool}.{name}" for name in components),
                name=self.register_map.name,
                identity=self.identity,
            ),
            tool=tool,
            components=components,
            remedy=tr(
                "Nothing was written. Run 'robolink expert plc check-map' with the same -c at "
                "the machine. A changed map has to be compared again."
            ),
            controller=self.identity,
            request=request,
        )
