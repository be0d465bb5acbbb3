"""The proof of a held board by its fiducials, as a value."""

from dataclasses import dataclass, replace
from typing import ClassVar

from robolink.calibration import BoardDrawing, VerifyResult, seen_from
from robolink.methods.board.procedure import verify_board
from robolink.methods.camera.proof import LookTest
from robolink.model import Pose
from robolink.runner import Procedure


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardTest(LookTest):
    """A proof by a camera of a board.

    Attributes:
        board: Where the fiducials are on it.
    """

    method: ClassVar[str] = "board"

    board: BoardDrawing

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        aside = seen_from(self.written, self.tip)
        return verify_board(
            self.station,
            self.plan,
            self.board,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            camera_error_mm=self.camera_error_mm,
            aside=replace(aside, u_deg=self.tip.u_deg - self.written.u_deg),
        )
