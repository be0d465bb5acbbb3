"""Which request is served now, and what it does (docs/reference/epson.md 1.2)."""

from collections.abc import Callable
from functools import cached_property, lru_cache

from robolink.protocols.epson_text import (
    ErrorCode,
    RemoteCommand,
    Request,
    StatusFlags,
    status_fields,
)
from robolink_simulators.epson.card import ControllerCard
from robolink_simulators.epson.condition import Condition, Task
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.variables import Variables
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.refusals import RequestRefused, SpelRefusal, malformed, number
from robolink_simulators.epson.remote.io_commands import Fields, Served, io_commands
from robolink_simulators.epson.remote.queries import Alarms, check_robot, query_commands

_HIGHEST_FUNCTION = {5: 7, 7: 63, 8: 63}


class CommandDesk:
    """Serves every command but Login, Logout, Execute and Abort.

    Attributes:
        starter: Starts the function of that number, where a program is loaded; raises Refusal.
    """

    def __init__(
        self,
        machine: Machine,
        condition: Condition,
        variables: Variables,
        alarms: Alarms,
        card: ControllerCard,
        *,
        options: EpsonOptions,
    ) -> None:
        self._machine = machine
        self._condition = condition
        self._options = options
        self.starter: Callable[[int], object] | None = None
        self._held = (variables, alarms, card)

    @cached_property
    def _served(self) -> dict[str, Served]:
        """The commands by lower-case name, made when the first is asked for: most ask none."""
        machine, (variables, alarms, card) = self._machine, self._held
        return {
            **io_commands(machine),
            **query_commands(machine, self._condition, card, self._options),
            "getvariable": variables.get,
            "setvariable": variables.set,
            "getalm": alarms.get,
            "resetalm": alarms.reset,
            "getcurrobot": lambda: (str(machine.robot_number),),
            "setcurrobot": self._set_current_robot,
            "setmotorson": lambda *robot: self._switch_motors(robot, on=True),
            "setmotorsoff": lambda *robot: self._switch_motors(robot, on=False),
            "start": self._start,
            "stop": self._stop,
            "pause": lambda: self._turn(Task.PAUSED),
            "continue": lambda: self._turn(Task.RUNNING),
            "reset": self._reset,
        }

    def admit(self, command: RemoteCommand, *, logged_in: bool, executing: bool) -> None:
        """Check everything that stands in the way of a command.

        The order of the checks is assumed: unknown, not logged in, monitoring only, an
        Execute running, a flag missing.

        Raises:
            Refused: 11, 20, 21, or what the option says for monitoring.
        """
        options = self._options
        unknown = command.since > options.rc_plus
        if unknown or (command.extended and not options.extended_queries):
            raise RequestRefused(ErrorCode.UNKNOWN_COMMAND)
        if command.name == "Login":
            return
        if not logged_in:
            raise RequestRefused(ErrorCode.UNKNOWN_COMMAND)
        if self._condition.monitoring_only and not command.in_monitoring:
            raise RequestRefused(options.monitoring_refusal)
        if executing and not command.allowed_during_execute(options.rc_plus):
            raise RequestRefused(ErrorCode.EXECUTE_RUNNING)
        judged = command.needs or command.forbids
        if judged and not _met(command, self._condition.flags()):
            raise RequestRefused(ErrorCode.NOT_READY)

    def serve(self, request: Request) -> Fields:
        """Carry a request out.

        Raises:
            Refused: A parameter does not fit.
        """
        try:
            return self._served[request.name.lower()](*request.parameters)
        except SpelRefusal as refusal:
            raise malformed() from refusal

    def check_home(self, robot: tuple[str, ...]) -> None:
        """Check what a Home names.

        Raises:
            Refused: There is no such robot, or no number where one is needed.
        """
        self._check_robot(robot)

    def status(self, *, executing: bool) -> Fields:
        """Answer GetStatus; whether an Execute shows is an option."""
        shown = executing and self._options.flags_during_execute == "running"
        flags = self._condition.flags(executing=shown)
        return status_fields(flags, self._condition.code, self._options.status_flags)

    def _set_current_robot(self, robot: str) -> Fields:
        chosen = check_robot(robot, self._machine)
        if chosen == 0 and self._options.robot_zero == "error_12":
            raise malformed()
        if chosen:
            self._machine.choose(chosen)
        return ()

    def _check_robot(self, robot: tuple[str, ...]) -> int:
        """Return the number of a robot, 0 for all; none where that means one of them."""
        if robot:
            return check_robot(robot[0], self._machine)
        if self._options.missing_robot_number == "error_12":
            raise malformed()
        in_force = self._options.missing_robot_number == "current"
        return self._machine.robot_number if in_force else 0

    def _switch_motors(self, robot: tuple[str, ...], *, on: bool) -> Fields:
        chosen = self._check_robot(robot)
        if chosen:
            self._machine.robots[chosen - 1].switch_motors(on)
        else:
            self._machine.switch_all_motors(on)
        return ()

    def _start(self, function: str) -> Fields:
        chosen = number(function, _HIGHEST_FUNCTION[self._options.rc_plus])
        if self.starter is not None:
            self.starter(chosen)
            return ()
        return self._turn(Task.RUNNING)

    def _stop(self) -> Fields:
        if self._condition.task is not Task.NONE:
            self._machine.reset_motion_parameters()
        return self._turn(Task.NONE)

    def _turn(self, task: Task) -> Fields:
        self._condition.task = task
        return ()

    def _reset(self) -> Fields:
        if self._condition.serious:
            raise RequestRefused(ErrorCode.NOT_READY)
        self._condition.reset()
        self._machine.reset_motion_parameters()
        if self._options.reset_outputs_off:
            self._machine.clear_outputs()
        return ()


@lru_cache(maxsize=512)
def _met(command: RemoteCommand, flags: StatusFlags) -> bool:
    return all(getattr(flags, name) for name in command.needs) and not any(
        getattr(flags, name) for name in command.forbids
    )
