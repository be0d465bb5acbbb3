"""Where a tool's last calibration puts the pin: what one touch of the next nozzle is compared with.

The offset that is written and the touches that it came from say together where the pin is,
``P = p + R t``. As long as that offset stays stored and the pin stays where it is, a new tip that
touches the pin shows by how much it differs from the old one (docs/reference/calibration.md 2.9).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from robolink.calibration import NeedleChain
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    Recorded,
    ToolOffset,
    describe_offset,
    read_offset,
)
from robolink.timing import local_label
from robolink.ways import Way, way

KEPT = (EntryKind.DONE, EntryKind.DECISION)
"""Entries that say that a value stays, and what it rests on."""


@dataclass(frozen=True, slots=True)
class LastTouch:
    """The pin as a tool's last calibration on it places it.

    Attributes:
        station: Name of the pin.
        place_mm: Where it is then, base.
        u_deg: U of the flange at the last touch.
        value: The offset that was written with it.
        chain: What has happened since the last full calibration.
        touch_sigma_mm: Standard deviation of one coordinate of one touch then, ``None`` if nothing
            told it.
        nozzle: Id of the nozzle that was mounted, empty when nobody gave one.
        at: When, as a label.
        touches: How many touches the place rests on.
        z_from: Where Z of the value came from, ``kept`` where nobody ever showed it.
    """

    station: str
    place_mm: tuple[float, float, float]
    u_deg: float
    value: ToolOffset
    chain: NeedleChain
    touch_sigma_mm: float | None
    nozzle: str
    at: str
    touches: int = 1
    z_from: str = "kept"


def find_last_touch(controller: Controller, tool: int, station: str) -> LastTouch:
    """Return the last calibration of a tool on a pin, if it stands for what is stored.

    Args:
        controller: The controller, connected; its record is looked at.
        tool: Number of the tool.
        station: Name of the pin.

    Raises:
        CalibrationError: ``no_last_touch``: there is none; ``reference_outdated``: the tool was
            changed since.

    Example:
        >>> from robolink.methods import PointsSource, find_last_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
        >>> from robolink.testing import MemoryController, MemoryMachine
        >>> class Nobody:  # implements robolink.Operator
        ...     def tell(self, text): ...
        >>> source = PointsSource(lambda: [Pose(298, 99, -20, 0), Pose(322, 91, -20, 180)])
        >>> tool = ToolPlan(1, source, verify=False, pin="PIN-07")
        >>> plan = ChangePlan((tool,), ask_before_write=False)
        >>> with MemoryController(MemoryMachine({1: ToolOffset(12, -3.5, -20)})) as controller:
        ...     report = NozzleChange(controller, plan, operator=Nobody()).run()
        ...     find_last_touch(controller, 1, "PIN-07").place_mm
        (310.0, 95.0, -40.0)
    """
    kept = controller.outcomes.recorded(tool=tool, kinds=KEPT)
    newest = newest_touch(kept, station)
    if newest is None:
        raise CalibrationError(
            "no_last_touch",
            tr(
                "Tool {tool} was never calibrated on station {station}.", tool=tool, station=station
            ),
            remedy=tr(
                "Make a full calibration there first: {calibrate}",
                calibrate=way(Way.CALIBRATE_TOOL_AT, tool=tool, station=station),
            ),
        )
    stored = controller.tools.read(tool)
    if not controller.tools.same(stored, newest.value):
        raise CalibrationError(
            "reference_outdated",
            tr(
                "Tool {tool} holds {stored}; its last touch at {station}, of {at}, "
                "belongs to {value}.",
                tool=tool,
                stored=describe_offset(stored),
                station=station,
                at=local_label(newest.at),
                value=describe_offset(newest.value),
            ),
            remedy=tr(
                "The tool is not what its last calibration left. Put that value back, or "
                "make a full calibration."
            ),
        )
    return newest


def newest_touch(kept: Iterable[Recorded], station: str) -> LastTouch | None:
    """Return the newest touch of a tool on a pin that is on record, ``None`` for none.

    Args:
        kept: Entries of the tool of the kinds :data:`KEPT`, the newest first.
        station: Name of the pin.
    """
    return next((found for found in (_last_touch(entry, station) for entry in kept) if found), None)


def _last_touch(entry: Recorded, station: str) -> LastTouch | None:
    said, value = entry.details.get("touch"), read_offset(entry.details.get("value"))
    if not isinstance(said, Mapping) or said.get("station") != station or value is None:
        return None
    sigma_mm = said["touch_sigma_mm"]
    return LastTouch(
        station=station,
        place_mm=(float(said["x_mm"]), float(said["y_mm"]), float(said["z_mm"])),
        u_deg=float(said["u_deg"]),
        value=value,
        chain=NeedleChain(
            float(said["sigma_mm"]),
            int(said["changes"]),
            # Records of before do not say it; their chain then starts where it had got to.
            said.get("full_sigma_mm"),
        ),
        touch_sigma_mm=None if sigma_mm is None else float(sigma_mm),
        nozzle=entry.signature.nozzle,
        at=entry.at,
        touches=int(said.get("touches", 1)),
        z_from=str(entry.details.get("z_from", "kept")),
    )
