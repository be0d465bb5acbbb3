"""What a person or the machine's own program does to a PLC with a map, past the wire."""

from contextlib import AbstractContextManager
from typing import Protocol

from robolink_simulators.plc.program import PlcProgram


class ActedOn(Protocol):
    """The PLC, as its panel sees it."""

    program: PlcProgram

    def acting(self) -> AbstractContextManager[int]:
        """Surround an act that comes past the wire."""

    def cut_links(self) -> None:
        """End every connection."""


class MappedPlcPanel:
    """The machine's permit, and its cable. Any thread may act.

    Args:
        plc: The controller.
    """

    def __init__(self, plc: ActedOn) -> None:
        self._plc = plc

    def give_permit(self) -> None:
        """Let the machine allow that offsets are changed."""
        with self._plc.acting():
            self._plc.program.permit(True)

    def withdraw_permit(self) -> None:
        """Let the machine allow it no longer."""
        with self._plc.acting():
            self._plc.program.permit(False)

    def cut_link(self) -> None:
        """Pull the cable of every client."""
        with self._plc.acting():
            self._plc.cut_links()
