"""The camera of a simulated cell, which takes pictures of where the robot is at that moment."""

import threading
from collections import deque
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from robolink.timing import NS_PER_S
from robolink_simulators.cell.picture_settings import PictureFaults, PictureLook
from robolink_simulators.cell.workplace import Workplace
from robolink_simulators.pictures.drawing import Pencil
from robolink_simulators.pictures.scene import DrawnScene, scene_of

_MOST_HELD: Final = 500
"""Scenes that are held: ten seconds of notes at the usual pace."""


class CellWithCamera(Protocol):
    """A simulated controller with a world around its robot."""

    seed: int

    @property
    def lock(self) -> AbstractContextManager[object]:
        """Held by whoever touches it."""

    @property
    def world(self) -> Workplace:
        """What is around the robot now; another one after a reset."""

    def acting(self) -> AbstractContextManager[int]:
        """Bring it to the present time and hold it for the block; gives that time, ns."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnFrame:
    """One picture.

    Attributes:
        grey: Its pixels, rows by columns.
        number: Which exposure it shows, counted from when the world was last set up. One that
            the camera had kept has a lower number than the exposures that were asked for.
        taken_ns: The simulated time at which the robot was where it shows.
        faults: What is wrong with it.
    """

    grey: npt.NDArray[np.uint8]
    number: int
    taken_ns: int
    faults: PictureFaults


@dataclass(frozen=True, slots=True)
class _Exposure:
    scene: DrawnScene
    faults: PictureFaults
    number: int


class DrawnCamera:
    """Draws what the up-looking camera of a cell sees whenever it is asked. Thread-safe.

    The controller is held only while places are noted, some 0.2 ms; the picture is drawn after.

    Args:
        simulator: Whose cell.
    """

    def __init__(self, simulator: CellWithCamera) -> None:
        self._simulator = simulator
        self._lock = threading.Lock()
        self._set_up: tuple[Workplace, int] | None = None
        self._asked = 0
        self._taken = deque[_Exposure](maxlen=_MOST_HELD)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height of its pictures."""
        with self._simulator.lock:  # its world may be made only now
            return self._simulator.world.camera.optics.size_px

    @property
    def asked(self) -> int:
        """How many pictures were asked for since the world was last set up."""
        return self._asked

    def expose(self) -> DrawnFrame:
        """Return a picture of the cell as it is now; faults of the world change that."""
        with self._simulator.acting() as now_ns:
            world = self._simulator.world
            look = world.parameters.picture_look
            with self._lock:
                shown = self._shown(world, now_ns)
        pencil = _pencil(self._simulator.seed, look)
        grey = pencil.draw(shown.scene, shown.faults, shown.number)
        return DrawnFrame(grey, shown.number, shown.scene.taken_ns, shown.faults)

    def grey(self) -> npt.NDArray[np.uint8]:
        """Return the pixels of :meth:`expose`."""
        return self.expose().grey

    def note(self) -> None:
        """Note where everything is, for pictures that are some seconds late; draws nothing."""
        with self._simulator.lock:
            late_s = self._simulator.world.parameters.picture_late_s
        if not late_s:
            return
        with self._simulator.acting() as now_ns, self._lock:
            world = self._simulator.world
            self._renew(world)
            self._taken.append(_Exposure(scene_of(world, now_ns), PictureFaults(), self._asked))

    def _renew(self, world: Workplace) -> None:
        """Count from one again where the world was set up anew; what was taken is kept."""
        set_up = (world, world.set_ups)
        if self._set_up != set_up:
            if self._set_up is None or self._set_up[0] is not world:
                self._taken.clear()
            self._set_up, self._asked = set_up, 0

    def _shown(self, world: Workplace, now_ns: int) -> _Exposure:
        """Return the exposure that is handed out for the next question."""
        self._renew(world)
        self._asked += 1
        faults = world.parameters.picture_faults.at(self._asked)
        before = self._taken[-1] if self._taken else None
        if faults.stuck != "no" and before is not None:
            if faults.stuck == "same":
                return _Exposure(before.scene, _kept(before.faults, faults), before.number)
            # A new number draws other noise over the old scene.
            return _Exposure(before.scene, faults, self._asked)
        self._taken.append(_Exposure(scene_of(world, now_ns), faults, self._asked))
        if faults.late_s:
            latest_ns = now_ns - round(faults.late_s * NS_PER_S)
            old = [it for it in self._taken if it.scene.taken_ns <= latest_ns]
            # Noise of its own: it was exposed between two places that were noted.
            return _Exposure((old[-1] if old else self._taken[0]).scene, faults, self._asked)
        if faults.late:
            return _of(self._taken[max(0, len(self._taken) - 1 - faults.late)], faults)
        return self._taken[-1]


def _of(exposure: _Exposure, faults: PictureFaults) -> _Exposure:
    """Return an old exposure as it is handed out now."""
    return _Exposure(exposure.scene, faults, exposure.number)


def _kept(drawn: PictureFaults, now: PictureFaults) -> PictureFaults:
    """Return faults that draw the same bytes as before, delivered as is due now."""
    return replace(drawn, halved=now.halved, gone=now.gone, slow_s=now.slow_s)


@lru_cache(maxsize=8)
def _pencil(seed: int, look: PictureLook) -> Pencil:
    return Pencil(seed, look)
