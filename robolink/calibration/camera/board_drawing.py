"""A board with fiducials, as its drawing shows it, and where they are on a tool."""

import math
from dataclasses import dataclass
from itertools import combinations

from robolink.calibration.camera.board import check_spacing
from robolink.calibration.core.pose_checks import require_finite, require_poses
from robolink.model import ToolOffset, rotate_xy


@dataclass(frozen=True, slots=True)
class BoardDrawing:
    """Fiducials of a board, in the axes that its tool is to have.

    Attributes:
        fiducials_mm: X and Y of each, in the order of their numbers.
    """

    fiducials_mm: tuple[tuple[float, float], ...]

    @classmethod
    def of_two(cls, spacing_mm: float) -> "BoardDrawing":
        """Return EPSON's board: the origin half way between two fiducials, X from 2 to 1."""
        return cls(((spacing_mm / 2, 0.0), (-spacing_mm / 2, 0.0)))

    @property
    def is_pair(self) -> bool:
        """Whether it is such a board."""
        spacing_mm = math.dist(self.fiducials_mm[0], self.fiducials_mm[1])
        return self == BoardDrawing.of_two(spacing_mm)

    def require_apart(self) -> None:
        """Refuse a drawing in which fiducials lie on each other.

        Raises:
            CalibrationError: ``too_few_poses``, ``non_finite`` or ``coincident_fiducials``.
        """
        require_poses(len(self.fiducials_mm), 2)
        for number, (x, y) in enumerate(self.fiducials_mm, start=1):
            require_finite(**{f"x of fiducial {number}": x, f"y of fiducial {number}": y})
        for one, other in combinations(self.fiducials_mm, 2):
            check_spacing(math.dist(one, other), None)

    def seen_from(self, board: ToolOffset) -> tuple[ToolOffset, ...]:
        """Return where the fiducials are, seen from the frame that holds the board there."""
        turned = [rotate_xy(x, y, board.u_deg) for x, y in self.fiducials_mm]
        return tuple(ToolOffset(board.x_mm + dx, board.y_mm + dy, board.z_mm) for dx, dy in turned)
