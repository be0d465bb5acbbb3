"""The drawn camera of a simulator in this process as a source of pictures, in virtual time."""

from hashlib import sha256
from typing import Final

from robolink.errors import CalibrationError
from robolink.eye.picture import CameraPicture
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, SystemClock
from robolink_simulators.pictures.camera import DrawnCamera

PATIENCE_S: Final = 5.0
"""A picture that takes longer is refused as late."""


class DrawnPictures:
    """Implements :class:`~robolink.eye.source.PictureSource`.

    Args:
        camera: The camera.
        identity: For the record.
        clock: By whose readings pictures are asked for; the robot's, in virtual time.
    """

    def __init__(
        self, camera: DrawnCamera, identity: str = "drawn", clock: Clock | None = None
    ) -> None:
        self._camera = camera
        self._identity = identity
        self._clock = clock or SystemClock()

    @property
    def identity(self) -> str:
        """Which camera."""
        return self._identity

    @property
    def exposure_us(self) -> float | None:
        """None: how bright pictures are is a parameter of the world."""
        return None

    def expose(self, exposure_us: float) -> None:
        """Do nothing, as a source whose exposure cannot be set."""

    def take(self) -> CameraPicture:
        """Return a picture of the cell as it is now, or as the faults of its world say.

        Raises:
            CalibrationError: ``camera_gone``, ``picture_late`` or ``picture_unreadable``.
        """
        asked_s = self._clock.now_ns() / NS_PER_S
        frame = self._camera.expose()
        if frame.faults.gone:
            raise CalibrationError(
                "camera_gone",
                tr("The simulated camera does not answer."),
                remedy=tr("Set picture_gone to false."),
            )
        if frame.faults.slow_s:
            self._clock.sleep(min(frame.faults.slow_s, PATIENCE_S))
        if frame.faults.slow_s > PATIENCE_S:
            raise CalibrationError(
                "picture_late",
                tr("No picture came within {seconds:g} s.", seconds=PATIENCE_S),
                remedy=tr("Set picture_slow_s to 0."),
            )
        if frame.faults.halved:
            raise CalibrationError(
                "picture_unreadable",
                tr("The simulated camera delivered half a picture."),
                remedy=tr("Set picture_halved to false."),
            )
        digest = sha256(frame.grey.tobytes()).hexdigest()
        name = str(self._camera.asked)
        return CameraPicture(frame.grey, asked_s, digest=digest, name=name)

    def close(self) -> None:
        """Do nothing: others may use the camera."""
