"""Cameras that belong to a controller, and are asked through it."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from robolink.model._controller import Controller
from robolink.model.motion.tip_sensor import Spot, TipSensor


@runtime_checkable
class ControllerSensor(Protocol):
    """A :class:`TipSensor` that is asked through the controller of the cell."""

    def beside(self, controller: Controller) -> TipSensor:
        """Return it as a connected controller shows it; reads only.

        Raises:
            ConfigError: This controller has no such camera.
        """


@runtime_checkable
class LookingController(Protocol):
    """A controller with a vision system of its own."""

    @property
    def identity(self) -> str:
        """Which controller this is."""

    def require_looks(self) -> None:
        """Find out whether looks can be taken; reads only.

        Raises:
            ConfigError: What takes them is not there.
        """

    def look(self, mark: int, *, program: int) -> Sequence[Spot]:
        """Take a look with a program of the controller.

        Args:
            mark: The tip (0), or the number of a fiducial.
            program: Which program.
        """
