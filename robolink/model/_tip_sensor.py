"""Sees a tip from a distance: a camera, as a procedure uses it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final, Protocol, runtime_checkable

from robolink.model._controller import Controller

if TYPE_CHECKING:
    from robolink.errors import CalibrationError

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


def sensor_address(text: str) -> str:
    """Return a camera's name or URL without anything that is secret.

    A user, a password or a token before ``@`` is left out. Of a web address those options
    keep their values that say which picture is meant, and no others: cameras take passwords there,
    too.

    Args:
        text: The name or URL.

    Example:
        >>> from robolink.model import sensor_address
        >>> sensor_address("http://me:secret@camera.local/snap?channel=2&pwd=secret")
        'http://camera.local/snap?channel=2&pwd=...'
    """
    scheme, separator, rest = text.partition("://")
    rest, question, query = rest.partition("?")
    place, slash, path = rest.partition("/")
    if "@" in path and _HALF_A_PASSWORD.search(place):
        place, path = "", f"@{path}"  # a slash in the password
        place, slash, path = path.rpartition("@")[2].partition("/")
    if question and _WEB.match(scheme):
        query = "&".join(_option(one) for one in query.split("&"))
    return f"{scheme}{separator}{place.rpartition('@')[2]}{slash}{path}{question}{query}"


def _option(text: str) -> str:
    key, equals, value = text.partition("=")
    if equals and not _SECRET.search(key) and _SHORT.fullmatch(value):
        return text
    return f"{key}{equals}..." if equals else "..."


_WEB: Final = re.compile(r"(?:[a-z0-9.-]+\+)?(?:https?|rtsps?)$", re.IGNORECASE)
_HALF_A_PASSWORD: Final = re.compile(r":(?!\d*$)(?![^\[]*\])")
_SECRET: Final = re.compile(
    "user|usr|login|name|pass|pwd|psw|key|token|auth|sid|session|secret|sign|code|pin|hash|cred",
    re.IGNORECASE,
)
_SHORT: Final = re.compile(r"[0-9.]{1,4}|[0-9]{2,4}[xX][0-9]{2,4}|jpe?g|png|bmp|pgm|true|false")
"""Values that say which picture is meant: a number, a size, a format."""


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
class StationSensor(Protocol):
    """A :class:`TipSensor` that has to know what is stated and taught of its station."""

    def at_station(self, details: Mapping[str, object], mm_per_px: float | None) -> TipSensor:
        """Return it for a station; the two share one open camera. Takes a picture.

        Args:
            details: What is stated and taught of the station, plain JSON.
            mm_per_px: Length of a pixel, ``None`` where that is not known yet.

        Raises:
            ConfigError: What it has to know is not stated.
            CalibrationError: The camera delivers no picture that can be used.
        """


@runtime_checkable
class LooksAtRest(Protocol):
    """A :class:`TipSensor` that makes sure itself that its pictures are not older than a look."""

    def look_at_rest(self, mark: int, pictures: int) -> Sequence[Sequence[Spot]]:
        """Return what :meth:`TipSensor.see` returns, for each of the pictures of one look.

        Args:
            mark: What is looked for.
            pictures: How many; the robot stands still until the last of them.
        """


@runtime_checkable
class ExplainsMisses(Protocol):
    """A :class:`TipSensor` that can tell why it saw nothing."""

    def why_unseen(self, mark: int) -> "CalibrationError | None":
        """Return why a mark was not seen in the last look, ``None`` for no known reason."""


@runtime_checkable
class KeepsPictures(Protocol):
    """A :class:`TipSensor` that keeps pictures of its looks, for the report of a change."""

    def of_change(self, change: str) -> None:
        """Note for which tool change pictures are taken from now on.

        Args:
            change: Its id; empty for none.
        """


@runtime_checkable
class NamesDoubts(Protocol):
    """A :class:`TipSensor` that can tell what speaks against its looks, though they count."""

    def doubts(self) -> tuple[str, ...]:
        """Return the codes of the doubts in all looks so far, as results have them."""


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
