"""Which keys count: those of a hand."""

import pytest
from robolink_cli.wizard.keys import KeyGate, name_of


def passed(*pressed):
    """Press keys at times; return what counted, and how often a burst was told."""
    gate, found, bursts, pending = KeyGate(), [], 0, sorted(pressed, key=lambda one: one[1])
    for tick in range(4000):
        now_s = tick / 1000
        found += [one.key for one in gate.due(now_s)]
        bursts += gate.burst_ended(now_s)
        while pending and pending[0][1] <= now_s:
            found += [one.key for one in gate.press(*pending[0])]
            pending.pop(0)
    return found, bursts


def test_keys_of_a_hand_count_one_by_one():
    assert passed(("6", 0.5), ("5", 0.65), ("5", 0.9)) == (["6", "5", "5"], 0)


def test_a_bar_code_with_cr_and_lf_counts_for_nothing():
    keys = [*"4006381333931", "c-m", "c-j"]
    for gap_s in (0.0002, 0.002, 0.01, 0.02):
        scanned = [(key, 0.5 + gap_s * at) for at, key in enumerate(keys)]
        found, bursts = passed(*scanned)
        assert (found, bursts) == ([], 1), gap_s
    assert passed(*scanned, ("5", 1.5)) == (["5"], 1)


def test_a_key_that_is_held_counts_each_time_it_repeats():
    for rate_s in (0.025, 0.033, 0.04):
        held = [("8", 0.5)] + [("8", 1.0 + rate_s * at) for at in range(20)]
        assert passed(*held) == (["8"] * 21, 0), rate_s


def test_one_digit_twice_faster_than_a_key_repeats_is_a_scanner():
    assert passed(("0", 0.5), ("0", 0.502)) == ([], 1)


@pytest.mark.parametrize("key", ["escape", "c-c"])
def test_what_stops_is_never_dropped(key):
    assert passed(("1", 0.5), ("2", 0.501), (key, 0.502), ("3", 0.503))[0][:1] == [key]


@pytest.mark.parametrize("key", ["escape", "c-c"])
def test_a_key_that_waited_is_gone_with_a_stop(key):
    assert passed(("5", 0.5), (key, 0.51))[0] == [key]


def test_after_a_burst_a_key_counts_only_where_its_end_was_seen():
    """The thread that reads had no turn from the burst on until this key was there."""
    for key, quiet_s, counts in (("5", 1.002, []), ("2", 1.02, []), ("5", 1.15, ["5"])):
        gate = KeyGate()
        assert gate.press("1", 1.0) == []
        assert gate.press("2", 1.001) == []
        assert gate.press(key, 1.2, quiet_s) == []
        assert [one.key for one in gate.due(1.3)] == counts


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("left", "4"),
        ("pagedown", "3"),
        ("insert", "0"),
        (" ", "main"),
        ("c-m", "enter"),
        ("7", "7"),
        ("c-i", "tab"),
    ],
)
def test_the_keypad_means_the_same_with_and_without_numlock(key, name):
    assert name_of(key) == name
