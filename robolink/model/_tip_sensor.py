"""Sees a tip from a distance: a camera, as a procedure uses it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Protocol, runtime_checkable

from robolink.model._controller import Controller

TIP: Final = 0
"""Mark that stands for the tip; fiducials of a held board count from 1."""


class SpotUnit(StrEnum):
    """The unit in which a sensor reports where it sees something."""

    PIXEL = "px"
    """Pixels of the image: X to the right and Y down, or as the sensor counts them."""

    BASE_MM = "mm"
    """Millimetres in the robot's base: the sensor was calibrated with its maker's own tools."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a sensor sees something, in its own unit.

    Attributes:
        x, y: Where.
        radius_px: Half the width of what was found, in pixels of the image; ``None`` where the
            finder does not tell it. All looks of one run have to agree in it.
        score: How sure the finder is, in its own measure; ``None`` where it does not tell. It is
            shown, and nothing rests on it: a finder is sure of a fleck, too.
    """

    x: float
    y: float
    radius_px: float | None = None
    score: float | None = None


class TipSensor(Protocol):
    """A camera that stands in the cell and finds the tip, or a fiducial, in its image.

    An object is one open camera. It is asked while the robot stands still, from one thread.
    """

    @property
    def identity(self) -> str:
        """Which camera this is, for the record: a serial number, a URL."""

    @property
    def unit(self) -> SpotUnit:
        """The unit in which :meth:`see` answers."""

    @property
    def resolution_px(self) -> tuple[int, int] | None:
        """Width and height of the image, ``None`` if that makes no difference."""

    @property
    def settle_s(self) -> float:
        """How long the robot must have stopped before an exposure may start, seconds."""

    def see(self, mark: int = TIP) -> Sequence[Spot]:
        """Expose anew and return everything in the image that looks like ``mark``.

        Nothing found is an empty sequence and two candidates are two: whoever asks refuses both.
        A picture that was taken before the call must never be used.

        Args:
            mark: :data:`TIP`, or the number of a fiducial.

        Whatever it raises ends the measurement, with the tool lifted.
        """

    def close(self) -> None:
        """Release the camera."""


@runtime_checkable
class ControllerSensor(Protocol):
    """A :class:`TipSensor` that is read through the cell's controller."""

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
        """Check that looks can be taken; reads only.

        Raises:
            ConfigError: What takes them is not there.
        """

    def look(self, mark: int, *, program: int) -> Sequence[Spot]:
        """Take a look with a program of the controller.

        Args:
            mark: The tip (0), or the number of a fiducial.
            program: Which program.
        """
