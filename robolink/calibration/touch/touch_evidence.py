"""Whether touches of one pin were made: jogs, answers in time, heights, and standoffs undone.

Source: docs/reference/evidence.md 1.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robolink.calibration.core.robust import Floats
from robolink.calibration.core.statistics import (
    normal_quantile,
    student_t,
    studentized_range_0999,
)
from robolink.calibration.touch.standoff import (
    NO_STANDOFF,
    Standoff,
    pin_columns,
    standoff_columns,
)
from robolink.calibration.touch.touch_limits import (
    LEAST_HEIGHT_LIMIT_MM,
    LEAST_JOG_MM,
    MOST_LEFT,
    MOST_RESIDUAL_MM,
    PERSON_SIGMA_Z_MM,
    PRINT_STEPS,
)
from robolink.model import Pose
from robolink.timing import FASTEST_ANSWER_S

_LEAST_TOUCHES: Final = 4
"""Fewer leave nothing by which standoffs could be told from scatter."""

_UPRIGHT: Final = 1e-4
"""Sine of the lean up to which heights are compared as they are: 0.02 mm at 120 mm."""

REFUSING: Final = (
    "not_touched",
    "typed_ahead",
    "touch_heights_differ",
    "touch_not_proven",
    "large_residual",
)
"""The grounds on which touches are refused, the most telling first."""


@dataclass(frozen=True, slots=True)
class WitnessedTouch:
    """One touch, and what is known of how it was made.

    Attributes:
        captured: Flange pose with the tip on the pin.
        arrival: Flange pose at which the robot stopped before, ``None`` where the person brought
            the tip from wherever it was.
        standoff: How far from the expected contact that was.
        seconds: From the question to the answer, ``None`` where nobody counted.
        contact: Whether a contact input switched since the arrival.
    """

    captured: Pose
    arrival: Pose | None = None
    standoff: Standoff = NO_STANDOFF
    seconds: float | None = None
    contact: bool = False

    @property
    def jog_mm(self) -> float | None:
        """How far the person jogged, ``None`` without an arrival."""
        if self.arrival is None:
            return None
        return math.dist(self.captured.coordinates()[:3], self.arrival.coordinates()[:3])

    def made(self, resolution_mm: float) -> bool:
        """Tell whether anything was done between arrival and answer.

        Args:
            resolution_mm: Last digit that the controller prints.
        """
        jog_mm = self.jog_mm
        return jog_mm is None or self.contact or jog_mm >= least_jog_mm(resolution_mm)

    @property
    def in_time(self) -> bool:
        """Whether the answer came after somebody could have read the question."""
        return self.seconds is None or self.seconds >= FASTEST_ANSWER_S


@dataclass(frozen=True, slots=True)
class TouchEvidence:
    """What a set of touches of one pin says about how they were made.

    Attributes:
        codes: Why they are refused, the most telling first; empty when they count.
        jog_mm: How far each was jogged, ``None`` without an arrival.
        not_touched, typed_ahead: Indices, from 0, of the touches that do not count for that.
        z_range_mm: Highest less lowest flange, ``None`` where the tool leans.
        z_limit_mm: What that may be.
        gamma: Share of the standoffs that was left, sideways and, of leaning tools, in height;
            the larger. 0 when the jogs undo them, 1 when they do not; ``None`` where it cannot
            be told.
        gamma_upper99: Its upper 99 % limit.
        max_residual_mm: Largest residual of pin and tip, ``None`` without a degree of freedom.
    """

    codes: tuple[str, ...]
    jog_mm: tuple[float | None, ...]
    not_touched: tuple[int, ...]
    typed_ahead: tuple[int, ...]
    z_range_mm: float | None
    z_limit_mm: float | None
    gamma: float | None
    gamma_upper99: float | None
    max_residual_mm: float | None

    @property
    def most_telling(self) -> str:
        """The one ground to name; empty where there is none.

        One touch that fits badly makes the share of the standoffs uncertain too; it is then that
        touch that is to be named.
        """
        uncertain = self.gamma is not None and self.gamma <= MOST_LEFT
        codes = self.codes
        if uncertain and codes[:1] == ("touch_not_proven",) and "large_residual" in codes:
            return "large_residual"
        return codes[0] if codes else ""


def judge_touches(
    touches: Sequence[WitnessedTouch],
    *,
    resolution_mm: float = 0.001,
    sigma_z_mm: float = PERSON_SIGMA_Z_MM,
) -> TouchEvidence:
    """Return whether touches of one pin were made.

    Args:
        touches: In the order in which they were made.
        resolution_mm: Last digit that the controller prints.
        sigma_z_mm: Standard deviation of a touch in height.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import WitnessedTouch, judge_touches
        >>> where_it_stopped = Pose(300, 100, -60, 0)
        >>> judge_touches([WitnessedTouch(where_it_stopped, arrival=where_it_stopped)]).not_touched
        (0,)
    """
    poses = [touch.captured for touch in touches]
    planar = stand_upright(poses)
    untouched = _indices(not touch.made(resolution_mm) for touch in touches)
    early = _indices(not touch.in_time for touch in touches)
    heights = [pose.z_mm for pose in poses]
    limit_mm = height_limit_mm(len(poses), sigma_z_mm) if planar and len(poses) > 1 else None
    range_mm = max(heights) - min(heights) if planar and poses else None
    left = _left_standing(touches, planar=planar)
    residual_mm = _max_residual_mm(poses, planar=planar)
    beside = any(touch.standoff != NO_STANDOFF for touch in touches)
    grounds = (
        bool(untouched),
        bool(early),
        limit_mm is not None and range_mm is not None and range_mm > limit_mm,
        left is not None and left[1] > MOST_LEFT,
        beside and residual_mm is not None and residual_mm > MOST_RESIDUAL_MM,
    )
    return TouchEvidence(
        codes=tuple(code for code, holds in zip(REFUSING, grounds, strict=True) if holds),
        jog_mm=tuple(touch.jog_mm for touch in touches),
        not_touched=untouched,
        typed_ahead=early,
        z_range_mm=range_mm,
        z_limit_mm=limit_mm,
        gamma=left[0] if left else None,
        gamma_upper99=left[1] if left else None,
        max_residual_mm=residual_mm,
    )


def least_jog_mm(resolution_mm: float) -> float:
    """Return the shortest jog that is one."""
    return max(LEAST_JOG_MM, PRINT_STEPS * resolution_mm)


def height_limit_mm(count: int, sigma_z_mm: float) -> float:
    """Return by how much the heights of so many touches of one pin may differ, 99.9 %."""
    return max(LEAST_HEIGHT_LIMIT_MM, studentized_range_0999(count) * sigma_z_mm)


def height_shows_from_mm(count: int, sigma_z_mm: float) -> float:
    """Return by how much one height of so many has to differ to be beyond that limit in 95 %."""
    scatter_mm = math.sqrt(2) * sigma_z_mm
    return height_limit_mm(count, sigma_z_mm) + normal_quantile(0.95) * scatter_mm


def stand_upright(poses: Sequence[Pose]) -> bool:
    """Tell whether the tool stands along the base's Z in all poses, either way up."""
    leans = [
        math.hypot(
            math.sin(math.radians(pose.v_deg)),
            math.cos(math.radians(pose.v_deg)) * math.sin(math.radians(pose.w_deg)),
        )
        for pose in poses
    ]
    return all(lean <= _UPRIGHT for lean in leans)


def _left_standing(
    touches: Sequence[WitnessedTouch], *, planar: bool
) -> tuple[float, float] | None:
    """Return which share of the standoffs is left, and its upper 99 % limit; the worse direction.

    The standoffs stand beside pin and tip in one least-squares fit, so that a new needle, or a pin
    elsewhere, is no share of them.
    """
    if len(touches) < _LEAST_TOUCHES:
        return None
    poses = [touch.captured for touch in touches]
    fitted = pin_columns(poses, planar=planar)
    standing = standoff_columns([touch.standoff for touch in touches], planar=planar)
    standing = standing[:, np.any(standing != 0.0, axis=0)]
    if not standing.shape[1]:
        return None
    positions = _positions(poses, planar=planar)
    columns = np.hstack([fitted, standing])
    dof = len(positions) - int(np.linalg.matrix_rank(columns))
    told = int(np.linalg.matrix_rank(columns)) - int(np.linalg.matrix_rank(fitted))
    if dof < 1 or told < standing.shape[1]:
        return None
    solution, _, _, _ = np.linalg.lstsq(columns, positions, rcond=None)
    left = positions - columns @ solution
    inverse = np.linalg.pinv(columns.T @ columns)
    spread = np.sqrt(np.diag(inverse) * float(left @ left) / dof)
    gammas = solution[fitted.shape[1] :]
    uppers = gammas + student_t(0.99, dof) * spread[fitted.shape[1] :]
    worst = int(np.argmax(uppers))
    return float(gammas[worst]), float(uppers[worst])


def _max_residual_mm(poses: Sequence[Pose], *, planar: bool) -> float | None:
    if not poses:
        return None
    columns, positions = pin_columns(poses, planar=planar), _positions(poses, planar=planar)
    if len(positions) <= int(np.linalg.matrix_rank(columns)):
        return None
    solution, _, _, _ = np.linalg.lstsq(columns, positions, rcond=None)
    left = (positions - columns @ solution).reshape(len(poses), -1)
    return float(np.linalg.norm(left, axis=1).max())


def _positions(poses: Sequence[Pose], *, planar: bool) -> Floats:
    axes = 2 if planar else 3
    found: Floats = np.array([pose.coordinates()[:axes] for pose in poses]).ravel()
    return found


def _indices(flags: Iterable[bool]) -> tuple[int, ...]:
    return tuple(index for index, flag in enumerate(flags) if flag)
