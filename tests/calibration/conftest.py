"""How often a calibration is simulated where the share of something is asked."""

import pytest

from tests.calibration._simulated import SAMPLE, TRIALS


@pytest.fixture(
    params=[
        pytest.param(SAMPLE, id="sample"),
        pytest.param(TRIALS, id="whole", marks=pytest.mark.soak),
    ]
)
def trials(request) -> int:
    """A sample each time; as many as tell a small error of an interval in ``make soak``."""
    number: int = request.param
    return number
