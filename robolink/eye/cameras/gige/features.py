"""Settings of a GigE camera, changed and put back in the reverse order.

Names of features are those of the GenICam Standard Features Naming Convention.
"""

import ctypes
from collections.abc import Callable
from typing import Final

from robolink.eye.cameras.gige.aravis import Aravis, AravisError

__all__ = ["CameraFeatures"]

_STARTS: Final = ("FrameStart", "FrameBurstStart", "AcquisitionStart")
"""What a trigger may start, the best first."""


class CameraFeatures:
    """The settings of one open camera.

    Args:
        library: The library.
        camera: The open camera.
    """

    def __init__(self, library: Aravis, camera: int) -> None:
        self._library = library
        self._camera = camera
        self._undo = list[Callable[[], object]]()

    def trigger_by_software(self) -> bool:
        """Let a picture begin at a command and at nothing else.

        Returns:
            Whether the camera can do that. Where not, its triggers are off.

        Raises:
            AravisError: The camera does not answer.
        """
        kinds = self._choices("TriggerSelector")
        for kind in kinds:
            self.set("TriggerSelector", kind)
            self._set_where_there("TriggerMode", "Off")
        wanted = next((kind for kind in _STARTS if kind in kinds), None)
        if kinds and wanted is None:
            return False
        if wanted is not None:
            self.set("TriggerSelector", wanted)
        # Some cameras have the command only while it is the source.
        if self._set_where_there("TriggerSource", "Software") and self.has("TriggerSoftware"):
            return self._set_where_there("TriggerMode", "On")
        return False

    def one_at_a_time(self, *, triggered: bool) -> None:
        """Let the camera send one picture for each start, or for each trigger.

        Raises:
            AravisError: The camera does not answer.
        """
        if not triggered and self._set_where_there("AcquisitionMode", "SingleFrame"):
            return
        self._set_where_there("AcquisitionMode", "Continuous")

    def set_exposure(self, exposure_us: float) -> None:
        """Set the exposure time, and let the camera keep it.

        Raises:
            AravisError: The camera does not answer, or cannot expose for so long.
        """
        self._set_where_there("ExposureAuto", "Off")
        before_us = self.exposure_us()
        set_to = "arv_camera_set_exposure_time"
        self._undo.append(lambda: self._library.checked(set_to, self._camera, before_us))
        self._library.checked(set_to, self._camera, float(exposure_us))

    def exposure_us(self) -> float:
        """Return the exposure time that is set.

        Raises:
            AravisError: The camera does not answer.
        """
        return float(self._library.checked("arv_camera_get_exposure_time", self._camera))

    def exposure_limits_us(self) -> tuple[float, float] | None:
        """Return the shortest and the longest exposure time; ``None`` if it cannot be set.

        Raises:
            AravisError: The camera does not answer.
        """
        if not self._library.checked("arv_camera_is_exposure_time_available", self._camera):
            return None
        least, most = ctypes.c_double(), ctypes.c_double()
        self._library.checked(
            "arv_camera_get_exposure_time_bounds",
            *(self._camera, ctypes.byref(least), ctypes.byref(most)),
        )
        return least.value, most.value

    def has(self, name: str) -> bool:
        """Return whether the camera has a feature that can be used now."""
        feature = name.encode("ascii")
        return bool(self._library.checked("arv_camera_is_feature_available", self._camera, feature))

    def get(self, name: str) -> str:
        """Return the choice that is set.

        Raises:
            AravisError: There is no such feature, or the camera does not answer.
        """
        feature = name.encode("ascii")
        told = self._library.checked("arv_camera_get_string", self._camera, feature)
        return (told or b"").decode("utf-8", "replace")

    def set(self, name: str, choice: str) -> None:
        """Set a choice, and remember the one before.

        Raises:
            AravisError: There is no such feature or choice, or the camera does not answer.
        """
        before = self.get(name)
        if before != choice:
            self._write(name, choice)
            self._undo.append(lambda: self._write(name, before))

    def put_back(self) -> None:
        """Set everything as it was; what cannot be set any more is left."""
        while self._undo:
            undo = self._undo.pop()
            try:
                undo()
            except AravisError:
                continue

    def _set_where_there(self, name: str, choice: str) -> bool:
        """Set a choice where the camera has it, and return whether it is set now."""
        if not self.has(name) or choice not in self._choices(name):
            return False
        self.set(name, choice)
        return self.get(name) == choice

    def _write(self, name: str, choice: str) -> None:
        feature, value = name.encode("ascii"), choice.encode("utf-8")
        self._library.checked("arv_camera_set_string", self._camera, feature, value)

    def _choices(self, name: str) -> tuple[str, ...]:
        """Return the choices that a feature has now; none where there is no such feature."""
        if not self.has(name):
            return ()
        number = ctypes.c_uint()
        found = self._library.checked(
            "arv_camera_dup_available_enumerations_as_strings",
            *(self._camera, name.encode("ascii"), ctypes.byref(number)),
        )
        if not found:
            return ()
        try:
            texts = ctypes.cast(found, ctypes.POINTER(ctypes.c_char_p))
            return tuple((texts[at] or b"").decode("utf-8") for at in range(number.value))
        finally:
            self._library.call("g_free", found)
