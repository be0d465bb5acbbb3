"""The number of simulated calibrations in tests of a share."""

import pytest

from tests.calibration._simulated import SAMPLE, TRIALS


@pytest.fixture(
    params=[
        pytest.param(SAMPLE, id="sample"),
        pytest.param(TRIALS, id="whole", marks=pytest.mark.soak),
    ]
)
def trials(request) -> int:
    """A sample normally; in ``make soak`` enough to show a small error of an interval."""
    number: int = request.param
    return number
