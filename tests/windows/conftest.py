"""One Windows Python for all judges, made once."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions

from tests.windows._cells import Opener, cell_for_windows
from tests.windows._windows_python import WindowsPython, made, suite_beside


@pytest.fixture(scope="session")
def windows() -> WindowsPython:
    """A Windows Python with the wheel of this source."""
    return made()


@pytest.fixture(scope="session")
def suite(windows: WindowsPython) -> Path:
    """The tests, where they import the wheel and not the source."""
    return suite_beside(windows)


@pytest.fixture
def simulator() -> EpsonSimulator:
    """A simulated controller of this machine.

    Its patience is that of the cell file. wine keeps the socket of a killed process for longer
    than the 60 s that controllers come with, and Windows closes it at once.
    """
    return EpsonSimulator(seed=7, options=EpsonOptions(remote_timeout_s=600))


@pytest.fixture
def pace() -> float:
    """How many times faster than real time that controller lives."""
    return 10.0


@pytest.fixture
def opened(
    windows: WindowsPython,
    simulator: EpsonSimulator,
    state: dict[str, str],
    tmp_path: Path,
    pace: float,
) -> Iterator[Opener]:
    """What runs a command at that controller in a console of Windows."""
    with cell_for_windows(windows, simulator, state, tmp_path, pace) as opener:
        yield opener


@pytest.fixture
def state(tmp_path: Path) -> dict[str, str]:
    """An empty state folder, as wine's Windows names it."""
    return {"ROBOLINK_STATE_DIR": f"Z:{tmp_path / 'state'}".replace("/", "\\")}
