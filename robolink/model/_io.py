"""Inputs and outputs, as every kind of controller that has some offers them."""

from typing import Protocol


class DigitalIo(Protocol):
    """Inputs and outputs by number."""

    def read_input(self, bit: int) -> bool:
        """Read one input."""

    def set_output(self, bit: int, on: bool) -> object:
        """Switch one output, and prove it as far as this controller lets it be proved.

        Raises:
            NotReadyError: The state forbids it.
            RejectedError: It was refused; nothing was switched.
            OutcomeUnknownError: No answer came; motion is blocked until ``recover``.
        """

    def preview_output(self, bit: int, on: bool) -> tuple[str, ...]:
        """Return what :meth:`set_output` would send, as it stands on the wire."""
