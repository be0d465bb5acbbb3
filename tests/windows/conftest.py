"""One Windows Python for all judges, made once."""

from pathlib import Path

import pytest

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
def state(tmp_path: Path) -> dict[str, str]:
    """An empty state folder, as wine's Windows names it."""
    return {"ROBOLINK_STATE_DIR": f"Z:{tmp_path / 'state'}".replace("/", "\\")}
