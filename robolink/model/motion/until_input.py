"""Movements that end, or are measured, where an input switches."""

from dataclasses import dataclass
from typing import Protocol

from robolink.errors import NotReadyError, NotReadyReason
from robolink.messages import tr
from robolink.model.motion.geometry import Pose


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

    def require_ahead(self, on: bool, *, controller: str, request: str) -> None:
        """Refuse an input that shows already what the movement waits for.

        An EPSON controller would take such a movement for finished at once, and a PLC would drive
        on to the target, the tip perhaps in contact (docs/reference/spel.md 7.1, docs/mailbox.md).

        Args:
            on: Whether the input is on before the movement begins.
            controller: Who is asked, for the error.
            request: What is asked, for the error.

        Raises:
            NotReadyError: Names the input.

        Example:
            >>> from robolink.model import InputEdge
            >>> InputEdge(3).require_ahead(False, controller="cell-a", request="move until input 3")
        """
        if self.awaited(on):
            raise NotReadyError(
                tr(
                    "Input {number} is {state} before the movement begins.",
                    number=self.number,
                    state=tr("on") if on else tr("off"),
                ),
                reason=NotReadyReason.EDGE_PASSED,
                remedy=tr(
                    "Nothing was moved. Check the number of the input, clean the sensor, and bring "
                    "the tip clear of it."
                ),
                controller=controller,
                request=request,
            )


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
