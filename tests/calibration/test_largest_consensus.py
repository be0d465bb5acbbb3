"""The largest set of poses that agree, whichever of the samples are followed together."""

import numpy as np
import pytest

from robolink.calibration import Robust, quaternion_rotations
from robolink.calibration.core.least_squares import _best_set, draw_poses
from robolink.calibration.pin import pivot

KINDS = [(threshold, outliers) for threshold in (0.12, 0.16, 0.3) for outliers in (0.0, 0.1, 0.3)]


def agreement_of(seed, outliers, monkeypatch):
    """Return what the search asks of touches of one point, some of them elsewhere."""
    random = np.random.default_rng(seed)
    count = int(random.integers(6, 40))
    turned = quaternion_rotations(random.normal(size=(count, 4)) * (0.3, 0.3, 1.0, 1.0))
    positions = np.array([350.0, -120.0, 85.0]) - turned @ np.array([4.2, -7.9, 131.6])
    positions += random.normal(0, 0.1, positions.shape)
    spoilt = random.permutation(count)[: int(outliers * count)]
    positions[spoilt] += random.normal(0, random.choice([0.5, 3.0, 30.0]), (len(spoilt), 3))
    asked = []
    with monkeypatch.context() as seen:
        seen.setattr(
            pivot, "largest_consensus", lambda agreement, *_, **__: asked.append(agreement)
        )
        pivot.pivot_consensus(positions, turned, Robust(), sigma_mm=None)
    return asked[0]


@pytest.mark.parametrize("seed", range(len(KINDS)))
def test_samples_that_begin_with_the_same_set_end_as_each_would_by_itself(seed, monkeypatch):
    threshold, outliers = KINDS[seed]
    agreement = agreement_of(seed, outliers, monkeypatch)
    robust, samples = Robust(), draw_poses(agreement.count, 3, 25, seed)
    together = _best_set(agreement, samples, robust, threshold, {})
    each = [_best_set(agreement, samples[n : n + 1], robust, threshold, {}) for n in range(25)]
    ends = [end for end in each if end is not None]
    assert together is not None
    best = min(ends, key=lambda end: end[:2])
    assert together[0] == best[0]
    assert together[1] == pytest.approx(best[1], rel=1e-9)
