from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.softmotion.group.profile import Pace, SpeedProfile

rates = st.floats(1e-3, 1e3)
paces = st.builds(Pace, rates, rates, rates)


def samples(profile, count=60):
    return [profile.share_at(profile.duration_s * step / count) for step in range(count + 1)]


@settings(max_examples=80, deadline=None)
@given(paces, st.floats(0, 0.99))
def test_a_profile_goes_from_its_start_to_the_end_within_its_limits(pace, start):
    profile = SpeedProfile.fastest(start, pace)
    shares = samples(profile)
    assert shares[0] == pytest.approx(start)
    assert profile.share_at(profile.duration_s) == 1
    assert all(b >= a - 1e-9 for a, b in pairwise(shares))
    step_s = profile.duration_s / 60
    assert all(b - a <= pace.rate_per_s * step_s * (1 + 1e-6) + 1e-9 for a, b in pairwise(shares))
    assert profile.rate_at(profile.falls_after_s) <= pace.rate_per_s * (1 + 1e-9)


@settings(max_examples=80, deadline=None)
@given(paces, st.floats(0.001, 0.999), rates)
def test_a_braked_profile_keeps_its_past_and_comes_to_rest_on_the_path(pace, part, fall):
    profile = SpeedProfile.fastest(0.0, pace)
    at_s = profile.duration_s * part
    braked = profile.braked(at_s, fall)
    assert braked.share_at(at_s / 2) == pytest.approx(profile.share_at(at_s / 2), abs=1e-9)
    assert braked.share_at(at_s) == pytest.approx(profile.share_at(at_s), abs=1e-9)
    assert braked.rate_at(at_s) == pytest.approx(profile.rate_at(at_s), rel=1e-6, abs=1e-9)
    assert profile.share_at(at_s) - 1e-9 <= braked.end <= 1
    just_before_s = braked.duration_s * (1 - 1e-9)
    assert braked.share_at(just_before_s) == pytest.approx(braked.end, abs=1e-6)
    assert braked.rate_at(braked.duration_s) == 0


def test_braking_twice_keeps_the_harder_end():
    profile = SpeedProfile.fastest(0.0, Pace(1.0, 10.0, 10.0)).braked(0.5, 5.0)
    again = profile.braked(0.55, 10.0)
    assert again.end < profile.end
    assert again.duration_s < profile.duration_s


def test_braking_after_the_end_changes_nothing():
    profile = SpeedProfile.fastest(0.0, Pace(1.0, 10.0, 10.0))
    assert profile.braked(profile.duration_s, 1.0) is profile


def test_braking_before_anything_moves_stays_where_it_is():
    braked = SpeedProfile.fastest(0.25, Pace(1.0, 10.0, 10.0)).braked(0.0, 1.0)
    assert (braked.end, braked.duration_s) == (0.25, 0)


def test_without_a_way_to_go_it_has_arrived():
    profile = SpeedProfile.fastest(0.0, None)
    assert (profile.end, profile.duration_s, profile.share_at(0)) == (1.0, 0, 1.0)
