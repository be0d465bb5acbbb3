"""Movements that end, or are measured, where an input switches."""

from dataclasses import dataclass
from typing import Protocol

from robolink.model._geometry import Pose


@dataclass(frozen=True, slots=True)
class InputEdge:
    """What a movement waits for.

    Attributes:
        number: The input as its controller counts: from 0 on an EPSON controller, from 1 in a
            PLC's mailbox.
        falling: Whether it is to go off, not on.
        run_on: Whether the movement goes on to its target after the edge.
    """

    number: int
    falling: bool = False
    run_on: bool = False

    def awaited(self, on: bool) -> bool:
        """Tell whether an input that is ``on`` shows what the movement waits for."""
        return on is not self.falling


class MotionUntilInput(Protocol):
    """A straight movement until an input switches, under way. Someone must wait on it."""

    def wait(self, *, timeout_s: float) -> Pose | None:
        """Wait for the end and return where the tip was at the edge.

        Returns:
            ``None`` when the input did not switch on the way; the movement has arrived then.
            What a controller cannot latch it reads at rest just past the edge: both edges of a
            beam, and both directions, are late by the same amount then.

        Raises:
            StoppedError: It was stopped before.
            ControllerFaultError: The controller went into error.
            OutcomeUnknownError: The link fell silent; the movement may go on.
            MotionTimeoutError: It did not end in time and was aborted.
        """
