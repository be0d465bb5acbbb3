"""The digital inputs and outputs beside the axis group."""

from collections.abc import Callable
from typing import Final

from robolink_simulators.softmotion.kinematics.kinematics import AxisValues
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

SIGNALS: Final = 32
"""Number of inputs, and of outputs (assumed)."""

Sense = Callable[[AxisValues], bool]
"""Returns the state of an input at given axis values, for example whether the tip of a nozzle then
breaks a light beam.
"""


class DigitalInputs:
    """Inputs 0 to 31: switched by hand, or connected to something that the robot meets."""

    def __init__(self) -> None:
        self._on = [False] * SIGNALS
        self._senses: dict[int, Sense] = {}

    def switch(self, number: int, on: bool) -> None:
        """Switch an input by hand; this disconnects it.

        Raises:
            Refused: There is no such input.
        """
        _require_signal(number)
        self._senses.pop(number, None)
        self._on[number] = on

    def connect(self, number: int, sense: Sense) -> None:
        """Connect an input to something whose state follows from where the robot is.

        Raises:
            Refused: There is no such input.
        """
        _require_signal(number)
        self._senses[number] = sense

    def read(self, number: int, axes: AxisValues) -> bool:
        """Return what an input shows with the axes at these values.

        Raises:
            Refused: There is no such input.
        """
        _require_signal(number)
        sense = self._senses.get(number)
        return self._on[number] if sense is None else sense(axes)


class DigitalOutputs:
    """Outputs 0 to 31, all off at first."""

    def __init__(self) -> None:
        self._on = [False] * SIGNALS

    def switch(self, number: int, on: bool) -> None:
        """Switch an output.

        Raises:
            Refused: There is no such output.
        """
        _require_signal(number)
        self._on[number] = on

    def read(self, number: int) -> bool:
        """Return what an output shows.

        Raises:
            Refused: There is no such output.
        """
        _require_signal(number)
        return self._on[number]


def _require_signal(number: int) -> None:
    if not 0 <= number < SIGNALS:
        raise BlockRefused(ErrorKind.PARAMETER, f"There is no signal {number}")
