"""What a controller is doing, in one word and in flags."""

from dataclasses import dataclass
from enum import StrEnum


class ControllerState(StrEnum):
    """The one word for what a controller is doing, worst first."""

    SERIOUS_FAULT = "serious fault"
    EMERGENCY_STOP = "emergency stop"
    FAULT = "fault"
    GUARD_OPEN = "guard open"
    TEACH = "teach"
    TEST = "test"
    NOT_REMOTE = "not in remote control"
    PAUSED = "paused"
    NO_POWER = "without power"
    DISABLED = "disabled"
    RUNNING = "running"
    READY = "ready"
    STARTING = "starting"


@dataclass(frozen=True, slots=True)
class ControllerStatus:
    """The state flags of a controller at one moment.

    ``code`` is the controller's own error or warning number, 0 when there is none. ``disabled``
    and ``unpowered`` are told by controllers only that can tell them beside everything else.
    """

    remote: bool = False
    ready: bool = False
    running: bool = False
    paused: bool = False
    fault: bool = False
    serious_fault: bool = False
    emergency_stop: bool = False
    guard_open: bool = False
    warning: bool = False
    teach: bool = False
    test: bool = False
    disabled: bool = False
    unpowered: bool = False
    code: int = 0

    @property
    def needs_reset(self) -> bool:
        """Whether a reset comes before anything else; a reset does not clear a serious fault."""
        return (self.emergency_stop or self.fault) and not self.serious_fault

    @property
    def state(self) -> ControllerState:
        """The worst thing that is true."""
        checks = (
            (self.serious_fault, ControllerState.SERIOUS_FAULT),
            (self.emergency_stop, ControllerState.EMERGENCY_STOP),
            (self.fault, ControllerState.FAULT),
            (self.guard_open, ControllerState.GUARD_OPEN),
            (self.teach, ControllerState.TEACH),
            (self.test, ControllerState.TEST),
            (not self.remote, ControllerState.NOT_REMOTE),
            (self.paused, ControllerState.PAUSED),
            (self.unpowered, ControllerState.NO_POWER),
            (self.disabled, ControllerState.DISABLED),
            (self.running, ControllerState.RUNNING),
            (self.ready, ControllerState.READY),
        )
        return next((state for true, state in checks if true), ControllerState.STARTING)
