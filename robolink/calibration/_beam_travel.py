"""The way of a frame from one passage through a beam to the next."""

from collections.abc import Sequence
from dataclasses import replace

from robolink.calibration._beam_drive import Passage
from robolink.calibration._beams import Crossing
from robolink.calibration._steps import Move, Procedure
from robolink.calibration._touch import travel
from robolink.messages import tr
from robolink.model import Path, Pose


class BeamTravel:
    """Takes a frame from passage to passage.

    Among the beams it goes straight and does not turn. It comes and goes straight up and down, and
    whatever turns or goes elsewhere does so above them.

    Args:
        here: Where the frame is.
    """

    def __init__(self, here: Pose) -> None:
        self._here = here
        self._last: Passage | None = None

    @property
    def last(self) -> Passage | None:
        """The passage at whose end it stands, ``None`` above the beams."""
        return self._last

    def through(self, passages: Sequence[Passage]) -> Procedure[list[Crossing]]:
        """Take passages at one angle of U; begins lifted, or where an earlier call at it ended.

        Raises:
            CalibrationError: As :meth:`Passage.cross`.
        """
        found = []
        for passage in passages:
            start = passage.start
            if self._last is None:
                above = replace(start, z_mm=passage.drive.safe_z_mm)
                yield from travel(above, here=self._here, purpose=tr("go above the beams"))
            if self._last is None or self._last.end != start:
                yield Move(start, Path.STRAIGHT, tr("go beside the beam"))
            found.append((yield from passage.cross()))
            self._last = passage
        return found

    def lifted(self) -> Procedure[None]:
        """Lift out of the beams; nothing where it is above them."""
        if self._last is None:
            return
        above = replace(self._last.end, z_mm=self._last.drive.safe_z_mm)
        self._here = yield Move(above, Path.STRAIGHT, tr("lift out of the beams"))
        self._last = None
