"""The path of a request in the controller: faults, log, hooks, handler.

Where a request goes: login, logout, the command window, or the desk.

Source: docs/reference/epson.md 1.1, 1.2.
"""

from abc import ABC
from collections.abc import Sequence
from functools import partial
from typing import Final

from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_binary import Dialect, EpsonBinaryCodec
from robolink.protocols.epson_text import (
    BadRequest,
    EpsonTextCodec,
    ErrorCode,
    Request,
    find_command,
)
from robolink_simulators.device.hosted import HostedDevice, PlannedActs
from robolink_simulators.epson.condition import Condition, RequestRefused, Task
from robolink_simulators.epson.flash import Flash
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.remote.command_window import SpelWindow
from robolink_simulators.epson.remote.commands import CommandDesk, Fields
from robolink_simulators.epson.remote.link import (
    ClientSlot,
    EpsonServerLink,
    PendingRequest,
    shown_reply,
    shown_request,
)
from robolink_simulators.faults import Departure, Fault, FaultAction, FaultPlan, LinkKind

_NO_TASK: Final = Task.NONE  # before Python 3.12 a member of an Enum is found slowly


def arriving(
    link: EpsonServerLink,
    event: Request | BadRequest,
    faults: Sequence[Fault],
    plan: FaultPlan,
    *,
    unterminated: bool,
) -> Request | BadRequest | None:
    """Return the request that the controller hears now.

    Args:
        link: Where it came over.
        event: The request that was sent.
        faults: Those that it meets.
        plan: Draws what a fault leaves open.
        unterminated: Whether a request may lack its line end.

    Returns:
        ``None`` when nothing of use arrives.

    Raises:
        RemoteProtocolError: What arrives makes no sense.
    """
    heard: Request | BadRequest | None = event
    for fault in faults:
        match fault.action:
            case FaultAction.DISCONNECT_BEFORE:
                link.cut()
                return None
            case FaultAction.DROP_REQUEST:
                return None
            case FaultAction.STALL:
                link.stall(event, fault.seconds)
                return None
            case FaultAction.GARBLE_REQUEST | FaultAction.TRUNCATE_REQUEST if heard:
                if link.dialect is None:
                    heard = _bent_text(heard, fault, plan, unterminated=unterminated)
                else:
                    heard = _bent_frame(heard, fault, plan, link.dialect)
    return heard


def _bent_text(
    event: Request | BadRequest, fault: Fault, plan: FaultPlan, *, unterminated: bool
) -> Request | BadRequest | None:
    sent = _on_the_wire(event)
    codec = EpsonTextCodec(Role.DEVICE, unterminated=unterminated)
    if fault.action is FaultAction.TRUNCATE_REQUEST:
        codec.receive_data(sent[: _cut_at(fault, sent)] or b" ")
        if unterminated:
            codec.end_of_request()
    else:
        codec.receive_data(plan.bent(sent, fault) + b"\r\n")
    return _heard(codec.next_event())


def _bent_frame(
    event: Request | BadRequest, fault: Fault, plan: FaultPlan, dialect: Dialect
) -> Request | BadRequest | None:
    """Behind a frame that is cut short the line is silent, and so ends it."""
    if isinstance(event, BadRequest):
        return event
    sent = EpsonBinaryCodec(Role.HOST, dialect).send(event)
    cut = fault.action is FaultAction.TRUNCATE_REQUEST
    codec = EpsonBinaryCodec(Role.DEVICE, dialect)
    codec.receive_data(sent[: _cut_at(fault, sent)] or b" " if cut else plan.bent(sent, fault))
    return _heard(codec.next_event()) or _heard(codec.end_of_request())


def _cut_at(fault: Fault, sent: bytes) -> int:
    return len(sent) // 2 if fault.position is None else fault.position % len(sent)


def _heard(event: object) -> Request | BadRequest | None:
    return event if event is not NEED_DATA and isinstance(event, (Request, BadRequest)) else None


def _on_the_wire(event: Request | BadRequest) -> bytes:
    """Return a request without its line end, as its client wrote it."""
    if isinstance(event, BadRequest):
        return f"${event.name}".encode("latin-1", "replace")
    if event.name.lower() == "execute":
        return f'${event.name},"{event.parameters[0]}"'.encode("latin-1", "replace")
    return ",".join((f"${event.name}", *event.parameters)).encode("latin-1", "replace")


class RequestService(HostedDevice, ABC):
    """Implements :class:`~robolink_simulators.epson.remote.link.RequestHandler`.

    It answers all but an Execute after its answer time.

    Attributes:
        options: The controller's habits.
        condition: What GetStatus shows.
        faults: What is planned to go wrong.
    """

    options: EpsonOptions
    condition: Condition
    faults: FaultPlan
    _password: str
    """The password that Login must give; empty for none."""
    _slot: ClientSlot
    _desk: CommandDesk
    _window: SpelWindow
    _mishaps: PlannedActs
    _flash: Flash
    _settled_ns: int
    """Time until which everything is done; -1 after any event that may have changed what follows.
    """

    def take(self, link: EpsonServerLink, event: Request | BadRequest) -> None:
        """Handle a request of a client; while another is logged in, it is not served."""
        self._settled_ns, shown = -1, shown_request(event)
        self.log.add(self.now_ns, ">", shown)
        if not self._slot.hears(link, cuts=self.options.second_client == "closed"):
            return
        faults = self.faults.take(shown, LinkKind.EPSON_SERIAL if link.dialect else None)
        if faults:
            self._take_disturbed(link, event, shown, faults)
        else:
            self._carry_out(link, event, shown, ())

    def _take_disturbed(
        self,
        link: EpsonServerLink,
        event: Request | BadRequest,
        shown: str,
        faults: tuple[Fault, ...],
    ) -> None:
        silence = self.options.requests_end_with_silence
        heard = arriving(link, event, faults, self.faults, unterminated=silence)
        if heard is None:
            return
        self._mishaps.strike(faults, self.now_ns)
        if link.over:  # a restart has closed it
            return
        self._carry_out(link, heard, shown, faults)
        for fault in faults:
            if fault.action is FaultAction.DUPLICATE_REQUEST:
                again = partial(self._carry_out, link, heard, shown, ())
                self._mishaps.plan(self.now_ns, fault.seconds, again)

    def take_late(self, link: EpsonServerLink, event: Request | BadRequest) -> None:
        """Handle a request that was in transit while its link carried nothing."""
        if self._slot.hears(link, cuts=self.options.second_client == "closed"):
            self._carry_out(link, event, shown_request(event), ())

    def _carry_out(
        self,
        link: EpsonServerLink,
        event: Request | BadRequest,
        shown: str,
        faults: tuple[Fault, ...],
    ) -> None:
        self._requests += 1
        exchange = PendingRequest(self._requests, event.name, faults, link)
        try:
            if self.on_request is not None:
                self.on_request(exchange.number, shown)
        finally:
            self._serve(link, exchange, event)
            self._flash.save_changes()

    def _serve(
        self, link: EpsonServerLink, exchange: PendingRequest, event: Request | BadRequest
    ) -> None:
        """Carry out a request, or refuse it."""
        try:
            name, request = self._admitted(link, event)
            if name == "Execute":
                self._window.start(request.parameters[0], exchange, self.now_ns)
            elif name == "Home":
                # The answer is sent on arrival of the arm, as for a motion of Execute (assumed).
                self._desk.check_home(request.parameters)
                self._window.start("Home", exchange, self.now_ns)
            elif name == "Abort":
                self._window.abort(exchange, self.now_ns)
            else:
                exchange.reply(*self._answer(link, name, request))
        except RequestRefused as refused:
            exchange.refuse(refused.code)

    def _admitted(self, link: EpsonServerLink, event: Request | BadRequest) -> tuple[str, Request]:
        """Return a request that is allowed now, with the name of its command.

        Raises:
            RequestRefused: It may not.
        """
        logged_in = self._slot.client is link
        if logged_in:
            self._slot.heard(self.now_ns)
        if isinstance(event, BadRequest):
            raise RequestRefused(event.code)
        command = find_command(event.name)
        if command is None:
            raise RequestRefused(ErrorCode.UNKNOWN_COMMAND)
        self._desk.admit(command, logged_in=logged_in, executing=self._window.busy)
        return command.name, event

    def _answer(self, link: EpsonServerLink, name: str, request: Request) -> Fields:
        match name:
            case "GetStatus":
                return self._desk.status(executing=self._window.busy)
            case "Login":
                return self._login(link, request)
            case "Logout":
                return self._logout(link)
            case _:
                return self._desk.serve(request)

    def _login(self, link: EpsonServerLink, request: Request) -> Fields:
        bare = not request.parameters
        if bare and self.options.login_without_parameter == "error_12":
            raise RequestRefused(ErrorCode.MALFORMED)
        password = "" if bare else request.parameters[0]
        # Assumed: a controller without a password accepts only an empty one.
        if password != self._password:
            raise RequestRefused(ErrorCode.WRONG_PASSWORD)
        self._slot.admit(link, self.now_ns)
        link.logged_in(True, self.now_ns)
        return ()

    def _logout(self, link: EpsonServerLink) -> Fields:
        if self._unfinished:
            # Logging out while a task runs raises an error (documented,
            # docs/reference/epson.md 1.1); assumed: like any error, it ends the running tasks.
            self._window.interrupt(self.now_ns)
            self.condition.raise_error(self.options.numbers.logged_out_in_task)
            if self.options.logout_while_running == "refused":
                raise RequestRefused(ErrorCode.NOT_READY)
        self._slot.free()
        link.logged_in(False, self.now_ns)
        return ()

    @property
    def _unfinished(self) -> bool:
        """Whether a statement or a task runs."""
        return self._window.busy or self.condition.task is not _NO_TASK

    def leaving(self, exchange: PendingRequest, reply: bytes) -> Sequence[Departure]:
        """Count a reply and return which parts of it are sent, and when."""
        self._flash.save_changes()
        self.exchanges += 1
        # A garbled login may be repeated in its refusal.
        echoed = bool(exchange.faults) and reply[:1] == b"!"
        self.log.add(self.now_ns, "<", "***" if echoed else shown_reply(reply))
        if not exchange.faults:
            self.faults.remember(reply)
            return ((self.answer_s, reply),)
        return self.faults.departures(reply, exchange.faults, after_s=self.answer_s)

    def listening(self) -> None:
        """Look anew for the next event: a request has begun that silence may end."""
        self._settled_ns = -1

    def announce(self, exchange: PendingRequest, reply: bytes) -> None:
        """Tell the hook that a reply is about to be sent."""
        if self.on_reply is not None:
            self.on_reply(exchange.number, shown_reply(reply))

    def forget(self, link: EpsonServerLink) -> None:
        """Note the end of a connection; an option decides whether running statements continue."""
        self._settled_ns = -1
        if self._slot.client is link:
            # This client does not supervise production that another device started.
            own = self._unfinished and not self.condition.monitoring_only
            self._slot.lost(unfinished=own)
            if self.options.execute_on_disconnect == "stops":
                self._window.interrupt(self.now_ns)
