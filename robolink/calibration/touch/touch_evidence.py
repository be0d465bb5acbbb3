"""Whether touches of a pin were really made: jogs, answer times, heights, undone standoffs.

The robot stops before each touch beside and above the pin, by a distance that is drawn. A person
who brings the tip onto the pin undoes that distance; who only presses ENTER does not, and no other
needle looks the same (docs/reference/evidence.md 1).
"""

import math
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robolink.calibration.core.least_squares import Floats
from robolink.calibration.core.rotations import pose_arrays
from robolink.calibration.core.statistics import (
    normal_quantile,
    student_t,
    studentized_range_0999,
)
from robolink.calibration.quality.doubts import (
    FARTHEST_MM,
    LEAST_HEIGHT_LIMIT_MM,
    LEAST_JOG_MM,
    LEVELS_MM,
    MOST_LEFT,
    MOST_RESIDUAL_MM,
    NEAREST_MM,
    PERSON_SIGMA_Z_MM,
    PRINT_STEPS,
)
from robolink.model import Pose
from robolink.timing import FASTEST_ANSWER_S

LEAST_UNEXPLAINED_MM2: Final = 0.28
"""Smallest part of the squared standoffs that no pin and no needle could explain, in mm^2, for each
touch beyond the second; with less, the test of the standoffs would find nothing."""

_MOST_DRAWS: Final = 1000
"""Largest number of draws: about one in three is kept; if the angles allow none, the best one is
used."""


@dataclass(frozen=True, slots=True)
class Standoff:
    """How far from the pin the tip stops, base, mm.

    Attributes:
        x_mm, y_mm: Sideways.
        z_mm: Above.
    """

    x_mm: float = 0.0
    y_mm: float = 0.0
    z_mm: float = 0.0


NO_STANDOFF: Final = Standoff()
"""Standoff of a touch for which the person jogged from wherever the tip was."""


class StandoffSeries:
    """Draws the standoffs of one measurement, one by one.

    Args:
        seed: Of the run; the same one gives the same standoffs.
        clearance_mm: Least height above the pin.
        sideways: Whether the tip also stops beside the pin; a contact input does without.
        planar: Whether the tool stands upright in all touches, so that heights are compared as
            they are.

    Example:
        >>> from robolink import Pose
        >>> from robolink.calibration import StandoffSeries
        >>> series = StandoffSeries(seed=7, clearance_mm=2)
        >>> standoff = series.next([], Pose(0, 0, 0, 90))
        >>> standoff.z_mm >= 2
        True
    """

    def __init__(
        self, seed: int, clearance_mm: float, *, sideways: bool = True, planar: bool = True
    ) -> None:
        self.seed = seed
        self._random = random.Random(f"standoff {seed}")
        self._clearance_mm = clearance_mm
        self._sideways = sideways
        self._planar = planar
        self._levels: list[float] = []
        self._last_mm = math.nan

    def next(self, taken: Sequence[tuple[Pose, Standoff]], orientation: Pose) -> Standoff:
        """Return where to stop before the next touch.

        Args:
            taken: The touches so far that count, with the standoff before each.
            orientation: In which the next one is made; only the angles count.
        """
        level_mm = self._next_level()
        poses = [pose for pose, _ in taken] + [orientation]
        before = [standoff for _, standoff in taken]
        needed_mm2 = LEAST_UNEXPLAINED_MM2 * (len(poses) - 2)
        best, most_mm2 = self._drawn(level_mm), -1.0
        # With three touches, pin and needle can explain the standoffs of a leaning tool in any
        # direction.
        if not self._sideways or len(poses) < (3 if self._planar else 4):
            return best
        explained = _basis(pin_columns(poses, planar=self._planar))
        for _ in range(_MOST_DRAWS):
            one = self._drawn(level_mm)
            found_mm2 = _unexplained_mm2(explained, [*before, one], planar=self._planar)
            if found_mm2 > most_mm2:
                best, most_mm2 = one, found_mm2
            if found_mm2 >= needed_mm2:
                break
        return best

    def _drawn(self, level_mm: float) -> Standoff:
        height_mm = self._clearance_mm + level_mm
        if not self._sideways:
            return Standoff(z_mm=height_mm)
        rho_mm = self._random.uniform(NEAREST_MM, FARTHEST_MM)
        way = self._random.uniform(0.0, math.tau)
        return Standoff(rho_mm * math.cos(way), rho_mm * math.sin(way), height_mm)

    def _next_level(self) -> float:
        """Return one of the levels: each once before any repeats, and never twice in a row."""
        if not self._levels:
            self._levels = self._random.sample(LEVELS_MM, len(LEVELS_MM))
            if self._levels[-1] == self._last_mm:
                self._levels.reverse()
        self._last_mm = self._levels.pop()
        return self._last_mm


def pin_columns(poses: Sequence[Pose], *, planar: bool) -> Floats:
    """Return the design matrix of a tip on one pin: the pin's place, and the tip's in the flange.

    The flange is at ``pin - R tip`` (docs/reference/calibration.md 1.1), so a touch has the rows
    ``(1, -R)``, of X and Y alone where the tool stands upright.

    Args:
        poses: Flange poses, mm and degrees.
        planar: Whether to take X and Y only.

    Returns:
        Two or three rows a pose, and twice as many columns.
    """
    axes = 2 if planar else 3
    turned = pose_arrays(poses)[1][:, :axes, :axes]
    ones = np.broadcast_to(np.eye(axes), turned.shape)
    columns: Floats = np.concatenate([ones, -turned], axis=2).reshape(-1, 2 * axes)
    return columns


def standoff_columns(standoffs: Sequence[Standoff], *, planar: bool) -> Floats:
    """Return how a touch left at its standoff would show: sideways, and in space in height too.

    Returns:
        As many rows as :func:`pin_columns`; one column, in space two.
    """
    sideways = np.array([(one.x_mm, one.y_mm, 0.0) for one in standoffs])
    if planar:
        return sideways[:, :2].reshape(-1, 1)
    upward = np.array([(0.0, 0.0, one.z_mm) for one in standoffs])
    return np.stack([sideways.ravel(), upward.ravel()], axis=1)


def _basis(columns: Floats) -> Floats:
    """Return orthonormal columns that span the same."""
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    kept: Floats = left[:, singular > singular[0] * 1e-9]
    return kept


def _unexplained_mm2(explained: Floats, standoffs: Sequence[Standoff], *, planar: bool) -> float:
    """Return the sum of squares of what pin and needle leave of the standoffs, at its weakest."""
    columns = standoff_columns(standoffs, planar=planar)
    left = columns - explained @ (explained.T @ columns)
    weakest: float = np.linalg.svd(left, compute_uv=False)[-1]
    return float(weakest) ** 2


_LEAST_TOUCHES: Final = 4
"""Smallest number of touches that separates standoffs from scatter."""

_UPRIGHT: Final = 1e-4
"""Sine of the largest lean at which heights are compared directly: 0.02 mm at 120 mm."""

REFUSING: Final = (
    "not_touched",
    "typed_ahead",
    "touch_heights_differ",
    "touch_not_proven",
    "large_residual",
)
"""Reasons for refusing touches, the most telling first."""


@dataclass(frozen=True, slots=True)
class WitnessedTouch:
    """One touch, and the evidence of how it was made.

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
        """Return whether the person did anything between arrival and answer.

        Args:
            resolution_mm: Last digit that the controller prints.
        """
        jog_mm = self.jog_mm
        return jog_mm is None or self.contact or jog_mm >= least_jog_mm(resolution_mm)

    @property
    def in_time(self) -> bool:
        """Whether the answer came after a person could have read the question."""
        return self.seconds is None or self.seconds >= FASTEST_ANSWER_S


@dataclass(frozen=True, slots=True)
class TouchEvidence:
    """What touches of one pin show about how they were made.

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
        """The strongest ground; empty without one.

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
    """Return whether touches of one pin were really made.

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
    left = _left_outcome(touches, planar=planar)
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
    """Return the shortest jog that counts as one."""
    return max(LEAST_JOG_MM, PRINT_STEPS * resolution_mm)


def height_limit_mm(count: int, sigma_z_mm: float) -> float:
    """Return by how much the heights of so many touches of one pin may differ, 99.9 %."""
    return max(LEAST_HEIGHT_LIMIT_MM, studentized_range_0999(count) * sigma_z_mm)


def height_shows_from_mm(count: int, sigma_z_mm: float) -> float:
    """Return by how much one height must differ to exceed that limit in 95 %."""
    scatter_mm = math.sqrt(2) * sigma_z_mm
    return height_limit_mm(count, sigma_z_mm) + normal_quantile(0.95) * scatter_mm


def stand_upright(poses: Sequence[Pose]) -> bool:
    """Return whether the tool is along the base's Z in all poses, either way up."""
    leans = [
        math.hypot(
            math.sin(math.radians(pose.v_deg)),
            math.cos(math.radians(pose.v_deg)) * math.sin(math.radians(pose.w_deg)),
        )
        for pose in poses
    ]
    return all(lean <= _UPRIGHT for lean in leans)


def _left_outcome(touches: Sequence[WitnessedTouch], *, planar: bool) -> tuple[float, float] | None:
    """Return which share of the standoffs is left, and its upper 99 % limit; the worse direction.

    The standoffs stand beside pin and tip in one least-squares fit, so that a new needle, or a pin
    elsewhere, is no share of them.
    """
    if len(touches) < _LEAST_TOUCHES:
        return None
    poses = [touch.captured for touch in touches]
    fitted = pin_columns(poses, planar=planar)
    outcome = standoff_columns([touch.standoff for touch in touches], planar=planar)
    outcome = outcome[:, np.any(outcome != 0.0, axis=0)]
    if not outcome.shape[1]:
        return None
    positions = _positions(poses, planar=planar)
    columns = np.hstack([fitted, outcome])
    dof = len(positions) - int(np.linalg.matrix_rank(columns))
    told = int(np.linalg.matrix_rank(columns)) - int(np.linalg.matrix_rank(fitted))
    if dof < 1 or told < outcome.shape[1]:
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
