"""How one touch of a known pin is solved: as a difference, or against the pin's place.

The offset that is written and the touches that it came from say together where the pin is,
``P = p + R t``. As long as that offset stays stored and the pin stays where it is, a new tip that
touches the pin shows by how much it differs from the old one (docs/reference/calibration.md 2.9).

How well the stored Z is known is traced back through what was kept: a calibration that left Z as it
was, and differences that were added to it, down to the measurement of Z itself. Whatever else wrote
Z, such as a typed value, ends the trace: then nothing is known of it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Final

from robolink.calibration import NORMAL_95, CalibrationResult, NeedleChain, NeedleLimits, StoredZ
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import (
    Controller,
    EntryKind,
    Pose,
    Recorded,
    ToolOffset,
    describe_offset,
    from_fields,
    read_offset,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label

if TYPE_CHECKING:
    from robolink.calibration import NeedleChangeResult, Pin


KEPT = (EntryKind.DONE, EntryKind.DECISION)
"""Entries that record that a value is kept, and its basis."""


@dataclass(frozen=True, slots=True)
class LastTouch:
    """Where a tool's last calibration on the pin puts it.

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
    """Return the last calibration of a tool on a pin, if it matches the stored value.

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
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> class Nobody:  # implements robolink.Operator
        ...     def tell(self, text): ...
        >>> source = PointsSource(lambda: [Pose(298, 99, -20, 0), Pose(322, 91, -20, 180)])
        >>> tool = ToolPlan(1, source, verify=False, pin="PIN-07")
        >>> plan = ChangePlan((tool,), ask_before_write=False)
        >>> with SimpleController(SimpleMachine({1: ToolOffset(12, -3.5, -20)})) as controller:
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
                calibrate=remedy_word(RemedyWord.CALIBRATE_TOOL_AT, tool=tool, station=station),
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
            remedy=tr("Write that value back, or run a full calibration."),
        )
    return newest


def newest_touch(kept: Iterable[Recorded], station: str) -> LastTouch | None:
    """Return the newest recorded touch of a tool on a pin, ``None`` for none.

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
        # Older records lack ``full_sigma_mm``; their chain starts from the uncertainty reached by
        # then.
        chain=from_fields(NeedleChain, said, partial=True),
        touch_sigma_mm=None if sigma_mm is None else float(sigma_mm),
        nozzle=entry.signature.nozzle,
        at=entry.at,
        touches=int(said.get("touches", 1)),
        z_from=str(entry.details.get("z_from", "kept")),
    )


@dataclass(frozen=True, slots=True)
class Difference:
    """Solves one touch as the difference from the last one of the same tool.

    Attributes:
        last: The last touch.
        sigma_mm: Standard deviation of one coordinate of one touch.
        limits: When a shift is not believed, and when a full calibration is due.
        stored_z: What is known of the stored Z; ``None`` for nothing on record.
    """

    upright: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("z_mm",)

    last: LastTouch
    sigma_mm: float
    limits: NeedleLimits
    stored_z: StoredZ | None = None

    @property
    def place_mm(self) -> tuple[float, float, float]:
        """Where the pin is, base."""
        return self.last.place_mm

    @property
    def u_deg(self) -> float | None:
        """U at which the pin was touched before."""
        return self.last.u_deg

    @property
    def sentence(self) -> str:
        """How the touch is used, for a report."""
        return tr("the difference from the last touch, of {at}", at=local_label(self.last.at))

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve exactly one touch; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import (  # numpy, imported only when used
            StoredZ,
            pin_touched,
            solve_needle_change,
        )

        touch = one_of(flange)
        old = self.last.value if stored is None else stored
        before = pin_touched(touch, old)
        before_mm = (before.x_mm, before.y_mm, before.z_mm)
        found = solve_needle_change(
            touch,
            before_mm,
            self.place_mm,
            stored=old,
            chain=self.last.chain,
            sigma_mm=self.sigma_mm,
            limits=self.limits,
            # The old tip is not touched again: its place comes from its own touch.
            shared_touch=True,
        )
        known = self.stored_z or StoredZ(old.z_mm)
        result = replace(found, method="one-touch").added_to(known, touch_sigma_mm=self.sigma_mm)
        if result.full_calibration_due or not self._one_more(result):
            return result
        return replace(result, warnings=("full_calibration_due",), full_calibration_due=True)

    def _one_more(self, result: "NeedleChangeResult") -> bool:
        """Return whether the next difference would be one too many."""
        later = result.chain.after(math.sqrt(2) * self.sigma_mm, shared_touch=True)
        half95_mm = result.half_width95[0] * later.sigma_mm / result.chain.sigma_mm
        return half95_mm > self.limits.tolerance_mm


@dataclass(frozen=True, slots=True)
class Absolute:
    """Solves one touch against a pin at a known place.

    Attributes:
        pin: Where it is.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm",)

    pin: "Pin"
    sigma_mm: float | None = None

    @property
    def place_mm(self) -> tuple[float, float, float]:
        """Where the pin is, base."""
        return self.pin.x_mm, self.pin.y_mm, self.pin.z_mm

    @property
    def u_deg(self) -> float | None:
        """No U is better than another."""
        return None

    @property
    def sentence(self) -> str:
        """How the touch is used, for a report."""
        return tr("the place of the pin")

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve exactly one touch; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_one_touch  # numpy, imported only when used

        return solve_one_touch(one_of(flange), self.pin, stored=stored, sigma_mm=self.sigma_mm)


def left_of(last: LastTouch, sigma_mm: float | None, limits: NeedleLimits) -> int | None:
    """Return how many more such changes are allowed before a full calibration.

    Args:
        last: The last touch.
        sigma_mm: Standard deviation of one coordinate of one touch; ``None`` for what the last
            calibration found.
        limits: When a full calibration is due.

    Returns:
        0 for now, ``None`` where nothing tells how well a touch repeats.
    """
    sigma = sigma_mm or last.touch_sigma_mm
    if sigma is None:
        return None
    return last.chain.changes_left(math.sqrt(2) * sigma, limits, shared_touch=True)


def difference_from_last(
    controller: Controller,
    tool: int,
    station: str,
    *,
    sigma_mm: float | None,
    limits: NeedleLimits,
) -> Difference:
    """Return how one touch of a tool is solved against its last one on a pin.

    Args:
        controller: The controller, connected.
        tool: Number of the tool.
        station: Name of the pin.
        sigma_mm: Standard deviation of one coordinate of one touch; ``None`` for what the last
            calibration found.
        limits: When a shift is not believed, and when a full calibration is due.

    Raises:
        CalibrationError: ``no_last_touch`` or ``reference_outdated``.
        ConfigError: Nothing tells how well a touch repeats.

    Example:
        >>> from robolink.calibration import NeedleLimits
        >>> from robolink.methods import PointsSource, difference_from_last
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
        >>> from robolink.controllers import SimpleController, SimpleMachine
        >>> class Nobody:  # implements robolink.Operator
        ...     def tell(self, text): ...
        >>> stored = ToolOffset(12, -4, -20)
        >>> source = PointsSource(lambda: [Pose(298, 99, -20, 0), Pose(322, 91, -20, 180)])
        >>> tool = ToolPlan(1, source, verify=False, pin="PIN-07")
        >>> with SimpleController(SimpleMachine({1: stored})) as controller:
        ...     plan = ChangePlan((tool,), ask_before_write=False)
        ...     report = NozzleChange(controller, plan, operator=Nobody()).run()
        ...     solver = difference_from_last(
        ...         controller, 1, "PIN-07", sigma_mm=0.02, limits=NeedleLimits()
        ...     )
        >>> new = solver.solve([Pose(297.8, 99, -20, 0)], stored)  # the next nozzle's one touch
        >>> round(new.offset.x_mm, 3), round(new.offset.y_mm, 3)
        (12.2, -4.0)
    """
    last = find_last_touch(controller, tool, station)
    sigma = sigma_mm or last.touch_sigma_mm
    if sigma is None:
        raise ConfigError(
            tr(
                "The repeatability of a touch is not known: the last calibration could not "
                "check it."
            ),
            remedy=tr(
                "Give {sigma} (in a recipe sigma_mm), or calibrate with n-angle once.",
                sigma=remedy_word(RemedyWord.SIGMA),
            ),
        )
    known = find_stored_z(controller, tool, last.value)
    return Difference(last, sigma, limits, known)


def one_of(poses: Sequence[Pose]) -> Pose:
    """Return the pose that the method takes.

    Raises:
        CalibrationError: ``too_few_poses``.
        ConfigError: There is more than one.
    """
    if not poses:
        raise CalibrationError(
            "too_few_poses",
            tr("No pose was given; the method needs one."),
            remedy=tr("Touch the pin once."),
        )
    if len(poses) > 1:
        raise ConfigError(
            tr("{count} poses were given; the method takes one.", count=len(poses)),
            remedy=tr("Give one, or use the method n-angle."),
        )
    return poses[0]


_SAME_MM: Final = 0.001
"""Largest difference between a value written and the same value read back, in mm: EPSON keeps 0.001
mm."""


@dataclass(slots=True)
class _Trace:
    """How far the trace has got.

    Attributes:
        z_mm: The value whose origin is looked for.
        added_mm2: Square of half the interval of what was added to it since, mm^2.
        nozzle: Id of the nozzle whose Z it is, empty for one that nobody named.
    """

    z_mm: float
    added_mm2: float = 0.0
    nozzle: str = ""


def find_stored_z(controller: Controller, tool: int, stored: ToolOffset) -> StoredZ:
    """Return a tool's stored Z, with the recorded measurement that it goes back to.

    Args:
        controller: The controller, connected; its record is looked at.
        tool: Number of the tool.
        stored: What it holds.

    Raises:
        ConfigError: The record cannot be read.

    Example:
        >>> from robolink.methods.one_touch.solvers import find_stored_z
        >>> from robolink.model import ToolOffset
        >>> from robolink.controllers import SimpleController
        >>> find_stored_z(SimpleController(), 1, ToolOffset(12, -4, -20)).on_record
        False
    """
    kinds = (*KEPT, EntryKind.CALIBRATION)
    return traced(controller.outcomes.recorded(tool=tool, kinds=kinds), stored)


def traced(entries: Iterable[Recorded], stored: ToolOffset) -> StoredZ:
    """Return the same from the entries of the tool, the newest first."""
    unknown, trace = StoredZ(stored.z_mm), _Trace(stored.z_mm)
    kept: Recorded | None = None
    for entry in entries:
        if entry.kind is EntryKind.CALIBRATION:
            # A measurement precedes the entry that kept its value; others were not kept.
            if kept is None or kept.change != entry.change:
                continue
            found = _measured(trace, kept, entry)
            if found is not None:
                half_mm, number = found
                return StoredZ(stored.z_mm, math.sqrt(half_mm**2 + trace.added_mm2), number)
            if not _goes_on(trace, kept, entry):
                return unknown
            kept = None
            continue
        value = read_offset(entry.details.get("value"))
        if value is None or (kept is not None and kept.change == entry.change):
            continue
        if kept is not None or abs(value.z_mm - trace.z_mm) > _SAME_MM:
            return unknown
        if "method" in entry.details:
            kept = entry
        elif not _left_z(entry, trace.z_mm):
            return unknown
    return unknown


def _measured(trace: _Trace, kept: Recorded, calibration: Recorded) -> tuple[float, int] | None:
    """Return half the interval that a calibration gave Z, and the entry; ``None`` for none."""
    said = calibration.details
    measured, halves = said.get("measured"), said.get("half_width95")
    if kept.details.get("z_from") != "measured" or not isinstance(measured, Sequence):
        return None
    if "z_mm" not in measured or not isinstance(halves, Sequence) or not halves:
        return None
    if trace.nozzle and _nozzle(kept) != trace.nozzle:
        return None  # of another needle than the stored one
    value, tip = read_offset(kept.details.get("value")), read_offset(kept.details.get("tip"))
    if value is None or tip is None or abs(value.z_mm - tip.z_mm) > _SAME_MM:
        return None  # the written value differs from the place where the tip was found
    earlier, half_mm = said.get("stored_z"), float(halves[list(measured).index("z_mm")])
    if isinstance(earlier, Mapping) and isinstance(earlier.get("half95_mm"), float):
        # Touches between the two cancel, so differences do not add up: go back to the start.
        return float(earlier["half95_mm"]), int(earlier["entry"])
    return half_mm, calibration.number


def _goes_on(trace: _Trace, kept: Recorded, calibration: Recorded) -> bool:
    """Continue a trace past a calibration that did not measure Z; False where it ends.

    A Z that was kept is that of the needle before: it holds for the new one where the heights of
    the touches said so, or where it is the same needle.
    """
    details, before = kept.details, read_offset(kept.details.get("before"))
    changed = calibration.details.get("changed")
    if before is None or (isinstance(changed, Sequence) and "z_mm" in changed):
        return False
    length, checked = details.get("length"), details.get("length_checked")
    nozzle = _nozzle(kept)
    same = bool(nozzle) and nozzle == (trace.nozzle or nozzle)
    follows = details.get("z_from") == "measured"
    said = length if isinstance(length, Mapping) else checked
    if abs(before.z_mm - trace.z_mm) > _SAME_MM and not (follows and length):
        return False
    if follows and isinstance(said, Mapping):
        trace.added_mm2 += (NORMAL_95 * float(said["u_mm"])) ** 2
    elif not same:
        return False
    trace.z_mm, trace.nozzle = before.z_mm, "" if follows else nozzle
    return True


def _nozzle(kept: Recorded) -> str:
    return str(kept.details.get("nozzle") or kept.signature.nozzle)


def _left_z(entry: Recorded, z_mm: float) -> bool:
    before = read_offset(entry.details.get("before"))
    return before is not None and abs(before.z_mm - z_mm) <= _SAME_MM
