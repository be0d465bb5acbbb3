"""A PLC that keeps its tool offsets in registers of the machine builder's own."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import Self

from robolink.controllers.markers import MarkerStore, ProcedureLock
from robolink.controllers.plc_map.flange import FlangeReader, no_motion
from robolink.controllers.plc_map.inputs import MappedInputs
from robolink.controllers.plc_map.probe import IdentityReader, require_probe
from robolink.controllers.plc_map.registers import RegisterClient, Registers
from robolink.controllers.plc_map.resolve import RegisterResolver
from robolink.controllers.plc_map.tools import RegisterToolTable
from robolink.errors import ConfigError, NotReadyError, NotReadyReason
from robolink.messages import tr
from robolink.model import (
    Act,
    Capabilities,
    ControllerFacts,
    ControllerStatus,
    Identity,
    Ledger,
    Marker,
    MarkerKind,
    NewEntry,
    OutcomeLog,
)
from robolink.register_maps import RegisterMap, confirmation_of
from robolink.standing import note_standing
from robolink.stop_latch import StopLatch
from robolink.timing import Clock


class PlcMapController:
    """A PLC that is reached by a map. Use it as a context manager.

    It moves nothing: a calibration takes its poses from a person.

    Attributes:
        register_map: Where everything stands.
        io: The inputs that the map names.

    Args:
        client: An open Modbus client; the controller owns it from here on.
        register_map: The map.
        outcomes: Where doubtful outcomes of this PLC are kept.
    """

    def __init__(
        self, client: RegisterClient, register_map: RegisterMap, outcomes: OutcomeLog
    ) -> None:
        self.register_map = register_map
        self._registers = Registers(client)
        self._outcomes = outcomes
        self._who = IdentityReader(self._registers, register_map)
        outcomes.ask(self._who.read)
        self._lock = ProcedureLock(client.identity, self._registers.latch)
        self._markers = MarkerStore(client.identity, outcomes, self._registers.latch)
        self._tools = RegisterToolTable(
            self._registers,
            register_map,
            self._markers,
            self._lock,
            require_confirmed=self._require_confirmed,
            require_ready=self._require_ready,
        )
        self._resolver = RegisterResolver(
            self._markers, self._tools, require_ready=self._require_ready
        )
        self._flange = FlangeReader(self._registers, register_map)
        self.io = MappedInputs(self._registers, register_map)

    @property
    def identity(self) -> str:
        """The URL, with those options only that tell PLCs apart."""
        return self._registers.identity

    @property
    def clock(self) -> Clock:
        """The clock on which the PLC's time passes."""
        return self._registers.clock

    @property
    def capabilities(self) -> Capabilities:
        """Tool offsets, where they stand in registers that can be written; no motion."""
        return Capabilities(tool_write=self.register_map.writable)

    @property
    def tools(self) -> RegisterToolTable:
        """The tools of the map."""
        return self._tools

    @property
    def groups(self) -> Sequence[FlangeReader]:
        """One, which tells where the flange is, if the map has that, and refuses to move."""
        return (self._flange,)

    @property
    def outcomes(self) -> OutcomeLog:
        """Open markers of this PLC."""
        return self._outcomes

    @property
    def ledger(self) -> Ledger:
        """What was done here since connecting, and how much of it is proved."""
        return self._markers.ledger

    @property
    def resolver(self) -> RegisterResolver:
        """Settles what was begun and not proved finished."""
        return self._resolver

    @property
    def exchanges(self) -> int:
        """Requests sent so far."""
        return self._registers.exchanges

    def who(self) -> Identity:
        """Return which PLC this is: what a person confirms about a map holds for that one.

        Raises:
            TransportError, RemoteProtocolError: The link failed, or its number does not stand
                still.
            NotReadyError: The map knows where the PLC's number stands, and there is none now.
        """
        found = self._who.read()
        if found.certain:
            return found
        raise NotReadyError(
            tr("The number by which the map knows {identity} reads zero.", identity=self.identity),
            reason=NotReadyReason.NOT_REMOTE,
            remedy=tr("Look whether the PLC's program runs, then try again; nothing was written."),
            controller=self.identity,
        )

    def require_probe(self) -> None:
        """Compare the PLC's constant with the map's, if there is one.

        Raises:
            RemoteProtocolError: It differs; says what the map should say.
        """
        require_probe(self._registers, self.register_map.probe)

    def status(self) -> ControllerStatus:
        """Read permit, busy and error; one that the map lacks never hinders.

        Others see by it that this process is alive, and an answer shows that the PLC is.
        """
        self._markers.beat()
        slot = next(iter(self.register_map.slots.values()))
        self._registers.read(slot.table, slot.span)
        fault, busy = self._tools.handshake.fault(), self._tools.handshake.busy
        return ControllerStatus(
            remote=self._permitted,
            ready=fault is None and not busy,
            running=busy,
            fault=fault is not None,
            code=fault or 0,
        )

    def facts(self) -> ControllerFacts:
        """Return what the map says about the machine; its PLC says nothing."""
        return ControllerFacts(controller_name=self.register_map.name)

    def error_text(self, code: int) -> str:
        """Return what the map says about an error number, empty where it says nothing."""
        return self._tools.handshake.error_text(code)

    def condition(self) -> dict[str, object]:
        """Read the tool in force, and the text of an error, as far as the map has them."""
        fault = self._tools.handshake.fault()
        return {
            "text": self.error_text(fault) if fault else "",
            "selected_tool": self._tools.selected() if self.register_map.selected else None,
            "map": self.register_map.name,
            "permitted": self._permitted,
        }

    def preview(self, act: Act) -> tuple[str, ...]:  # noqa: ARG002 - the model's form
        """Refuse; see :meth:`stop`."""
        raise no_motion(self.identity)

    @property
    def latch(self) -> StopLatch:
        """What holds every write back from :meth:`stop` until :meth:`release_stop`."""
        return self._registers.latch

    def stop(self) -> None:
        """Write nothing from here on; the machine itself nothing here can stop.

        Raises:
            RejectedError: Always; the message says to use the emergency stop.
        """
        self._registers.latch.close()
        raise no_motion(self.identity)

    def release_stop(self) -> None:
        """Let this process write again after :meth:`stop`, because a person says so."""
        self._registers.latch.release()

    def reset_fault(self) -> None:
        """Refuse; see :meth:`stop`."""
        raise no_motion(self.identity)

    def motors(self, on: bool) -> None:  # noqa: ARG002 - the model's form
        """Refuse; see :meth:`stop`."""
        raise no_motion(self.identity)

    def require_settled(self, request: str) -> None:
        """Refuse ``request`` while something earlier is unsettled.

        Raises:
            OutcomeUnknownError: Names it.
        """
        self._markers.require_settled(request)

    def begin(
        self,
        kind: MarkerKind,
        request: str,
        details: Mapping[str, object],
        *,
        operation: str = "",
    ) -> Marker:
        """Store the durable marker of a procedure; see the model."""
        return self._markers.begin(kind, request, details, operation=operation)

    def finish(self, marker: Marker, *entries: NewEntry) -> None:
        """Forget the marker of a procedure, and journal how it ended."""
        self._markers.clear(marker, *entries)

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Hold Ctrl-C back for a block that must be seen through."""
        return self._registers.gate

    @contextmanager
    def preserved(self, reason: str) -> Iterator[None]:
        """Keep other procedures out; nothing is selected or moved, so nothing is put back."""
        with self._lock.held(reason), self._markers.ledger.block():
            self._markers.look()
            self._markers.require_settled(reason)
            yield

    def close(self) -> None:
        """Close the link. Idempotent."""
        self._registers.close()
        self._outcomes.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
        if error is not None:
            note_standing(error, self.ledger.standing())

    @property
    def _permitted(self) -> bool:
        permit = self.register_map.permit
        return permit is None or self._registers.is_on(permit)

    def _require_ready(self, request: str) -> None:
        """Refuse a write where the map is not known to be right, or the machine says no."""
        self._require_confirmed(request)
        self.require_probe()
        permit = self.register_map.permit
        if permit is not None and not self._registers.is_on(permit):
            raise NotReadyError(
                tr("The machine does not permit changes now ({place}).", place=permit.place),
                reason=NotReadyReason.NOT_REMOTE,
                remedy=tr("Permit it at the machine, then try again; nothing was written."),
                controller=self.identity,
                request=request,
            )

    def _require_confirmed(self, request: str) -> None:
        """Refuse a change by a map without a probe that nobody has compared; writes nothing."""
        if self.register_map.probe is None and not confirmation_of(
            self.who().name, self.register_map
        ):
            raise ConfigError(
                tr(
                    "The map {name!r} has no probe, and nobody has confirmed it at {identity} yet.",
                    name=self.register_map.name,
                    identity=self.identity,
                ),
                remedy=tr(
                    "Run 'robolink plc check-map' with the same -c and compare with the HMI. A map "
                    "that was changed is confirmed anew. Nothing was written."
                ),
                controller=self.identity,
                request=request,
            )
