"""Where a request goes: login, logout, the command window, or the desk.

Source: docs/reference/epson.md 1.1, 1.2.
"""

from robolink.protocols.epson_text import (
    BadRequest,
    ErrorCode,
    RemoteCommand,
    Request,
    find_command,
)
from robolink_simulators.epson.condition import Condition, Task
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.refusals import RequestRefused
from robolink_simulators.epson.remote.client_slot import ClientSlot
from robolink_simulators.epson.remote.command_window import SpelWindow
from robolink_simulators.epson.remote.commands import CommandDesk
from robolink_simulators.epson.remote.exchange import PendingRequest
from robolink_simulators.epson.remote.link import EpsonServerLink


class Service:
    """Carries requests out, and answers all but an Execute at once.

    Args:
        desk: Serves what is done at once.
        window: Runs statements.
        slot: Who is logged in.
        condition: The state that a bad logout changes.
        options: The controller's habits.
        password: What Login must carry; empty for none.
    """

    __slots__ = (
        "_condition",
        "_desk",
        "_options",
        "_password",
        "_slot",
        "_window",
    )

    def __init__(
        self,
        desk: CommandDesk,
        window: SpelWindow,
        slot: ClientSlot,
        condition: Condition,
        *,
        options: EpsonOptions,
        password: str,
    ) -> None:
        self._desk = desk
        self._window = window
        self._slot = slot
        self._condition = condition
        self._options = options
        self._password = password

    @property
    def unfinished(self) -> bool:
        """Whether a statement or a task runs."""
        return self._window.busy or self._condition.task is not Task.NONE

    def carry_out(
        self,
        link: EpsonServerLink,
        exchange: PendingRequest,
        event: Request | BadRequest,
        now_ns: int,
    ) -> None:
        """Do what a request asks, or refuse it."""
        logged_in = self._slot.client is link
        if logged_in:
            self._slot.heard(now_ns)
        try:
            if isinstance(event, BadRequest):
                raise RequestRefused(event.code)
            command = find_command(event.name)
            if command is None:
                raise RequestRefused(ErrorCode.UNKNOWN_COMMAND)
            self._desk.admit(command, logged_in=logged_in, executing=self._window.busy)
            self._dispatch(link, exchange, command, event, now_ns=now_ns)
        except RequestRefused as refused:
            exchange.refuse(refused.code)

    def _dispatch(
        self,
        link: EpsonServerLink,
        exchange: PendingRequest,
        command: RemoteCommand,
        request: Request,
        *,
        now_ns: int,
    ) -> None:
        match command.name:
            case "GetStatus":
                exchange.reply(*self._desk.status(executing=self._window.busy))
            case "Execute":
                self._window.start(request.parameters[0], exchange, now_ns)
            case "Home":
                # It answers when the arm is there, as a motion of Execute does (assumed).
                self._desk.check_home(request.parameters)
                self._window.start("Home", exchange, now_ns)
            case "Abort":
                self._window.abort(exchange, now_ns)
            case "Login":
                self._login(link, request, now_ns)
                exchange.reply()
            case "Logout":
                self._logout(link, now_ns)
                exchange.reply()
            case _:
                exchange.reply(*self._desk.serve(request))

    def _login(self, link: EpsonServerLink, request: Request, now_ns: int) -> None:
        bare = not request.parameters
        if bare and self._options.login_without_parameter == "error_12":
            raise RequestRefused(ErrorCode.MALFORMED)
        password = "" if bare else request.parameters[0]
        # That a controller without a password takes an empty one only is assumed.
        if password != self._password:
            raise RequestRefused(ErrorCode.WRONG_PASSWORD)
        self._slot.admit(link, now_ns)
        link.logged_in(True, now_ns)

    def _logout(self, link: EpsonServerLink, now_ns: int) -> None:
        if self.unfinished:
            # Logging out while a task runs raises an error (documented,
            # docs/reference/epson.md 1.1); that the error ends what runs, as errors do, is assumed.
            self._window.interrupt(now_ns)
            self._condition.raise_error(self._options.numbers.logged_out_in_task)
            if self._options.logout_while_running == "refused":
                raise RequestRefused(ErrorCode.NOT_READY)
        self._slot.free()
        link.logged_in(False, now_ns)
