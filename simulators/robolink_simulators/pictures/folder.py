"""Writes the pictures of a drawn camera into a folder, as cameras do that deliver files by FTP.

A file grows where it stands, so whoever reads it too early reads half of it. A picture is exposed
when its file is begun.
"""

import threading
from contextlib import suppress
from pathlib import Path
from typing import Final

from robolink.interrupts import ClosedAtExit
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.picture_files import ENCODERS

PERIOD_S: Final = 0.5
MOST_FILES: Final = 20
_CHUNK_BYTES: Final = 256 * 1024


class PictureFolder(ClosedAtExit):
    """Writes pictures until it is closed, and removes its own old ones.

    Args:
        camera: The camera.
        folder: Where; it exists.
        ending: ``pgm``, ``png`` or ``jpg``.
        period_s: Real seconds from picture to picture; 0 writes only when :meth:`deliver` is
            called.
    """

    def __init__(
        self,
        camera: DrawnCamera,
        folder: Path,
        *,
        ending: str = "png",
        period_s: float = PERIOD_S,
    ) -> None:
        self._camera = camera
        self._folder = folder
        self._ending = ending
        self._encode = ENCODERS[ending][1]
        self._written: list[Path] = []
        self._count = 0
        self._period_s = period_s
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="picture folder", daemon=True)
        if period_s:
            self._thread.start()

    def deliver(self) -> Path | None:
        """Expose a picture and write its file; ``None`` where the camera is gone.

        Raises:
            OSError: It cannot be written.
        """
        self._camera.note()
        frame = self._camera.expose()
        if frame.faults.slow_s and self._ends.wait(frame.faults.slow_s):
            return None
        if frame.faults.gone:
            return None
        data = self._encode(frame.grey)
        if frame.faults.halved:
            data = data[: len(data) // 2]
        self._count += 1
        path = self._folder / f"{self._count:06}.{self._ending}"
        self._written.append(path)
        # Without a buffer: what a reader sees grows as on the line.
        with path.open("wb", buffering=0) as file:
            for start in range(0, len(data), _CHUNK_BYTES):
                file.write(data[start : start + _CHUNK_BYTES])
        while len(self._written) > MOST_FILES:
            self._written.pop(0).unlink(missing_ok=True)
        return path

    def close(self) -> None:
        """Write no more. Idempotent."""
        self._ends.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._ends.wait(self._period_s):
            with suppress(OSError):  # as with a camera whose server is full: the next may get in
                self.deliver()
