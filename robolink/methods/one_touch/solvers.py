"""How the one touch of a known pin is solved: as a difference, or against the place of the pin."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from robolink.calibration import CalibrationResult, NeedleLimits
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.methods.one_touch.last_touch import LastTouch, find_last_touch
from robolink.methods.one_touch.stored_z import find_stored_z
from robolink.model import Controller, Pose, ToolOffset
from robolink.timing import local_label
from robolink.ways import Way, way

if TYPE_CHECKING:
    from robolink.calibration import NeedleChangeResult, Pin, StoredZ


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
    limits: "NeedleLimits"
    stored_z: "StoredZ | None" = None

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
        from robolink.calibration import (  # numpy, which a look does without
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
            # The old tip is where its own touch left it; nobody touches it again.
            shared_touch=True,
        )
        known = self.stored_z or StoredZ(old.z_mm)
        result = replace(found, method="one-touch").added_to(known, touch_sigma_mm=self.sigma_mm)
        if result.full_calibration_due or not self._one_more(result):
            return result
        return replace(result, warnings=("full_calibration_due",), full_calibration_due=True)

    def _one_more(self, result: "NeedleChangeResult") -> bool:
        """Tell whether the next difference would already be one too many."""
        later = result.chain.after(math.sqrt(2) * self.sigma_mm, shared_touch=True)
        half95_mm = result.half_width95[0] * later.sigma_mm / result.chain.sigma_mm
        return half95_mm > self.limits.tolerance_mm


@dataclass(frozen=True, slots=True)
class Absolute:
    """Solves one touch against a pin whose place is known.

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
        from robolink.calibration import solve_one_touch  # numpy, which a look does without

        return solve_one_touch(one_of(flange), self.pin, stored=stored, sigma_mm=self.sigma_mm)


def left_of(last: LastTouch, sigma_mm: float | None, limits: NeedleLimits) -> int | None:
    """Return after how many more such changes a full calibration is due.

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
        >>> from robolink.testing import MemoryController, MemoryMachine
        >>> class Nobody:  # implements robolink.Operator
        ...     def tell(self, text): ...
        >>> stored = ToolOffset(12, -4, -20)
        >>> source = PointsSource(lambda: [Pose(298, 99, -20, 0), Pose(322, 91, -20, 180)])
        >>> tool = ToolPlan(1, source, verify=False, pin="PIN-07")
        >>> with MemoryController(MemoryMachine({1: stored})) as controller:
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
                "It is not known how well a touch repeats: the last calibration left "
                "nothing that checks it."
            ),
            remedy=tr(
                "Give {sigma} (in a recipe sigma_mm), or calibrate with n-angle once.",
                sigma=way(Way.SIGMA),
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
