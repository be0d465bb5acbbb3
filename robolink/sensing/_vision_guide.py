"""The camera of an EPSON controller's own vision system, asked through the controller.

``vision-guide``, or ``vision-guide?program=7``: which mainN of the project takes the look.
"""

from collections.abc import Sequence
from typing import Final
from urllib.parse import parse_qs, urlsplit

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import TIP, Controller, LookingController, Spot, SpotUnit

VISION_GUIDE: Final = "vision-guide"

PROGRAM: Final = 7
"""Number of the function main7; every version of RC+ can start it (docs/reference/epson.md 1.2)."""

SETTLE_S: Final = 0.2
"""How long the robot stands still before a look (assumed)."""

_HIGHEST_PROGRAM: Final = 63


class VisionGuideCamera:
    """Implements :class:`~robolink.model.TipSensor` and ``ControllerSensor``.

    It answers in millimetres of the base: the sequences have a calibration.

    Args:
        program: Number of the function that takes a look.
        controller: Who has it; none until it is known.
    """

    def __init__(self, program: int = PROGRAM, controller: LookingController | None = None) -> None:
        self._program = program
        self._controller = controller

    @property
    def identity(self) -> str:
        """What it is called, and whose it is."""
        whose = f" of {self._controller.identity}" if self._controller else ""
        return f"{VISION_GUIDE}?program={self._program}{whose}"

    @property
    def unit(self) -> SpotUnit:
        """Millimetres of the base."""
        return SpotUnit.BASE_MM

    @property
    def resolution_px(self) -> tuple[int, int] | None:
        """Of no account: it answers in millimetres."""
        return None

    @property
    def settle_s(self) -> float:
        """Seconds of the controller's clock."""
        return SETTLE_S

    def beside(self, controller: Controller) -> "VisionGuideCamera":
        """Return it as a connected controller shows it; reads only.

        Raises:
            ConfigError: This kind has no vision system, or its project no program for it.
        """
        if not isinstance(controller, LookingController):
            raise ConfigError(
                tr("{controller} has no vision system of its own.", controller=controller.identity),
                remedy=tr("Name another camera; this one is for EPSON controllers."),
            )
        controller.require_looks()
        return VisionGuideCamera(self._program, controller)

    def see(self, mark: int = TIP) -> Sequence[Spot]:
        """Take a look; see :class:`~robolink.model.TipSensor`.

        Raises:
            ConfigError: It is not known which controller it belongs to.
        """
        if self._controller is None:
            raise ConfigError(
                tr("{camera} is asked through its controller.", camera=VISION_GUIDE),
                remedy=tr("Use it in a calibration of that controller."),
            )
        return self._controller.look(mark, program=self._program)

    def close(self) -> None:
        """Nothing was opened."""


def open_vision_guide(url: str) -> VisionGuideCamera:
    """Open the camera that a text names; nothing is sent yet.

    Raises:
        ConfigError: An option is unknown, or no number of a function.
    """
    options = parse_qs(urlsplit(url).query, keep_blank_values=True)
    text = options.pop("program", [str(PROGRAM)])[-1]
    known = text.isascii() and text.isdecimal() and int(text) <= _HIGHEST_PROGRAM
    if options or not known:
        raise ConfigError(
            tr("{url!r} names no camera of a vision system.", url=url),
            remedy=tr("Write vision-guide, or vision-guide?program=N with N from 0 to 63."),
        )
    return VisionGuideCamera(int(text))
