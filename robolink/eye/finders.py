"""Which finder looks for which mark."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.eye.candidate import Candidate, MarkFinder
from robolink.eye.settings import EyeSettings
from robolink.messages import tr
from robolink.model import TIP

if TYPE_CHECKING:
    from robolink.eye.picture import CameraPicture

__all__ = ["finder_of"]


def finder_of(mark: int, settings: EyeSettings) -> MarkFinder:
    """Return what looks for a mark in a picture.

    Args:
        mark: The tip, or the number of a fiducial.
        settings: What is known of it.

    Raises:
        ConfigError: It is not known how wide the fiducials are.
    """
    return _tips(settings) if mark == TIP else _fiducials(mark, settings)


def _tips(settings: EyeSettings) -> MarkFinder:
    def find(picture: "CameraPicture") -> Sequence[Candidate]:
        from robolink.eye.tip_finder import find_tips  # numpy, imported only when used

        return find_tips(picture.grey, settings.tip)

    return find


def _fiducials(number: int, settings: EyeSettings) -> MarkFinder:
    shape = settings.fiducial
    if shape is None:
        raise ConfigError(
            tr("It is not known how wide the fiducials of the board are in the picture."),
            remedy=tr("State mark_mm in the cell file, and calibrate the camera."),
        )

    def find(picture: "CameraPicture") -> Sequence[Candidate]:
        grey = picture.grey
        if settings.marks == "round":
            from robolink.eye.pads import find_pads  # numpy, imported only when used

            return find_pads(grey, shape)
        if settings.marks == "cross":
            from robolink.eye.crosses import find_crosses

            return find_crosses(grey, shape)
        from robolink.eye.aruco import find_aruco

        return find_aruco(grey, shape, number=number, family=settings.marks)

    return find
