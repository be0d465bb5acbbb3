"""What a program may measure with: a pin, two beams, its camera."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.serving._judging import CallbackLimits
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult, VerifyResult
    from robolink.stations import Station


class ProgramMeasure(Protocol):
    """What one calibration of a program measures, and proves, with.

    Attributes:
        length: How many fields follow a pose.
        by_contact: Whether an input showed each touch, so that nobody had to see it.
    """

    length: ClassVar[int]
    by_contact: ClassVar[bool]

    def add(self, flange: Pose, seen: Sequence[str], *, proof: bool) -> int:
        """Take a flange pose and what was seen there; return how many there are now.

        Raises:
            CalibrationError: It is refused.
            RemoteProtocolError: It makes no sense.
        """

    def solve(self, stored: ToolOffset) -> "CalibrationResult":
        """Return the offset that was measured; what is not measured is kept from ``stored``.

        Raises:
            CalibrationError: Nothing trustworthy follows; its code says why.
        """

    def prove(self, result: "CalibrationResult", written: ToolOffset) -> "VerifyResult":
        """Return what was seen after the write about the new offset.

        Raises:
            CalibrationError: It is no proof; its code says why.
        """

    def from_place(
        self, result: "CalibrationResult", written: ToolOffset, proof: "VerifyResult"
    ) -> "VerifyResult":
        """Return a proof as drifts from the place that was measured or is known."""

    def on_record(self) -> Mapping[str, object]:
        """Return what was measured, plain JSON."""


def measure_named(
    name: str, limits: CallbackLimits, station: Callable[[str, StationKind], "Station"]
) -> ProgramMeasure:
    """Return what a program asked for: a method, and behind ``@`` the station it stands at.

    Args:
        name: ``n-angle``, ``pivot``, ``camera``, or ``beams@STATION``.
        limits: What its measurement is held to.
        station: Finds a station of the program's controller.

    Raises:
        CalibrationError: ``unknown_method``.
        ConfigError: There is no such station, or nobody knows where it is.
    """
    from robolink.serving._looks import ProgramLooks
    from robolink.serving._touches import touches_by

    method, at, place = name.partition("@")
    if method == "beams" and place:
        from robolink.methods.beams import BeamsParameters
        from robolink.serving._crossings import ProgramCrossings
        from robolink.stations import beam_station

        beams = beam_station(station(place, StationKind.BEAMS))
        return ProgramCrossings(beams, limits, max_lean_deg=BeamsParameters().max_lean_deg)
    if at or method not in ("n-angle", "pivot", "camera"):
        raise CalibrationError(
            "unknown_method", tr("There is no calibration method {name!r}.", name=name)
        )
    if method == "camera":
        return ProgramLooks(limits)
    return touches_by(method, limits)
