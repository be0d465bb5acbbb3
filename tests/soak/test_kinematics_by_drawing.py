"""Every kinematics at ten thousand axis positions each, drawn at random."""

import pytest
from robolink_simulators.softmotion.catalogue import NAMES

from tests.unit._softmotion_rows import drawn


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", NAMES)
def test_the_image_holds_ten_thousand_flanges_and_their_axes_are_found_again(name):
    """Inverse of forward, with the same configuration; tests/unit draws four of each."""
    for pose in drawn(name, 10_000, seed=2):
        pose.require_found()
