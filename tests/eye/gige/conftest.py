"""A GigE camera on loopback, which is the fake one of Aravis, with pictures that tell their time.

Without the library the tests are skipped, or fail where NEED_ARAVIS says that it has to be there.
There is one such camera on a computer at a time: tests in other processes wait for each other.
"""

import fcntl
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from robolink_simulators.pictures.gige_camera import GigeCamera, GigeFrame

from robolink.errors import ConfigError, ConnectError
from robolink.eye.cameras.gige.aravis import aravis
from robolink.eye.cameras.gige.opening import open_gige
from robolink.eye.cameras.gige.source import GigeSource
from tests.eye.gige._scene import ADDRESS, SIZE_PX

INSTALL = "apt-get install --no-install-recommends libaravis-0.8-0"
PATIENT_S = 45.0


@pytest.fixture(scope="session")
def library():
    """The library; without it the test is skipped, or fails where it is needed."""
    try:
        return aravis()
    except ConfigError:
        why = f"no Aravis here ({INSTALL})"
        if os.environ.get("NEED_ARAVIS"):
            pytest.fail(why, pytrace=False)
        pytest.skip(why)


@contextmanager
def alone(patient_s: float = PATIENT_S) -> Iterator[None]:
    """Wait until no other process has the port."""
    until_s = time.monotonic() + patient_s
    with open(Path(tempfile.gettempdir()) / "robolink-gige-port.lock", "a") as lock:
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                assert time.monotonic() < until_s, "another process keeps the port of GigE Vision"
                time.sleep(0.02)
            else:
                yield
                return


@pytest.fixture
def serve(library) -> Iterator[Callable[..., GigeCamera]]:
    """Serve a scene; what else is given goes to the camera."""
    with ExitStack() as stack:
        stack.enter_context(alone())

        def served(scene: Callable[[], GigeFrame], **options: Any) -> GigeCamera:
            size_px = options.pop("size_px", getattr(scene, "size_px", SIZE_PX))
            until_s = time.monotonic() + PATIENT_S
            while True:
                try:
                    camera = GigeCamera(scene, size_px, **options)
                except ConnectError:  # of a program that knows nothing of the lock
                    if time.monotonic() > until_s:
                        raise
                    time.sleep(0.05)
                else:
                    return stack.enter_context(camera)

        yield served


@pytest.fixture
def opened() -> Iterator[Callable[..., GigeSource]]:
    """Open the camera, to be closed at the end of the test."""
    with ExitStack() as stack:

        def open_it(camera: str = ADDRESS, **options: Any) -> GigeSource:
            source = open_gige(camera, **options)
            stack.callback(source.close)
            return source

        yield open_it
