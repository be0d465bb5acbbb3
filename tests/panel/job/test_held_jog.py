"""A held jog: one step at most after a finger is lost, and none by a finger that was lost."""

import itertools
import socket
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_cli.wizard.lease import LEASE_S, JogLease
from robolink_cli.wizard.views.records import EndView, TouchView
from robolink_simulators.control.assist import InProcessEyes

from tests.panel.job._tablet import Hand, Tablet, at_the_wire, to_the_jog


def held(lease, now_s):
    hold = lease.held(now_s)
    return None if hold is None else hold.finger


def test_a_finger_holds_as_long_as_it_beats():
    lease = JogLease()
    lease.hold(3, "x+", "a", 0.0)
    for turn in range(1, 40):
        assert held(lease, 0.1 * turn) == "a"
        lease.beat("a", 0.1 * turn)
    hold = lease.held(3.9)
    assert hold is not None
    assert (hold.number, hold.axis) == (3, "x+")


@pytest.mark.parametrize("late_s", [LEASE_S + 1e-6, 1.2, 60.0])
def test_a_finger_that_was_silent_is_dead_for_ever_even_if_its_beats_come_again(late_s):
    lease = JogLease()
    lease.hold(3, "x+", "a", 0.0)
    lease.beat("a", late_s)  # nobody asked meanwhile
    assert held(lease, late_s) is None
    lease.hold(3, "x+", "a", late_s)
    lease.beat("a", late_s)
    assert held(lease, late_s) is None
    lease.hold(3, "x+", "b", late_s)
    assert held(lease, late_s) == "b"


def test_each_sign_of_a_finger_is_good_for_one_step():
    lease = JogLease()
    assert not lease.spend(0.0)
    lease.hold(3, "x+", "a", 0.0)
    assert [lease.spend(0.01), lease.spend(0.02), lease.spend(0.24)] == [True, False, False]
    lease.beat("a", 0.24)
    lease.beat("a", 0.241)
    lease.beat("b", 0.242)
    assert [lease.spend(0.25), lease.spend(0.25)] == [True, False]
    lease.beat("a", 0.3)
    assert not lease.spend(0.3 + LEASE_S + 1e-6)


def test_a_finger_that_was_lifted_is_dead_also_if_its_hold_comes_after():
    lease = JogLease()
    lease.release("a")
    lease.hold(3, "x+", "a", 0.0)
    assert held(lease, 0.0) is None
    lease.hold(3, "x+", "b", 0.0)
    lease.release("b")
    lease.beat("b", 0.1)
    lease.hold(3, "x+", "b", 0.1)
    assert held(lease, 0.1) is None


def test_the_beats_and_the_end_of_another_finger_count_for_nothing():
    lease = JogLease()
    lease.hold(3, "x+", "a", 0.0)
    lease.beat("b", 0.2)
    lease.release("c")
    assert held(lease, 0.2) == "a"
    assert held(lease, 0.26) is None


def test_a_second_finger_ends_both():
    lease = JogLease()
    lease.hold(3, "x+", "a", 0.0)
    lease.hold(3, "z-", "b", 0.1)
    assert held(lease, 0.1) is None
    for finger in "ab":
        lease.hold(3, "x+", finger, 0.1)
        lease.beat(finger, 0.1)
        assert held(lease, 0.1) is None


def test_the_same_finger_does_not_change_its_key():
    lease = JogLease()
    lease.hold(3, "x+", "a", 0.0)
    lease.hold(4, "z-", "a", 0.1)
    hold = lease.held(0.1)
    assert hold is not None
    assert (hold.number, hold.axis, hold.seen_s) == (3, "x+", 0.0)


def test_fingers_without_end_are_not_remembered_without_end():
    lease = JogLease()
    for number in range(20_000):
        lease.release(f"f{number}")
    lease.hold(3, "x+", "new", 0.0)
    assert held(lease, 0.0) is None, "who cannot be remembered as lifted does not begin"


EVENTS = st.tuples(
    st.sampled_from(["hold", "beat", "release", "ask"]),
    st.sampled_from("abc"),
    st.floats(0.0, 0.4),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(EVENTS, max_size=30))
def test_whatever_comes_a_key_is_held_only_within_the_lease_of_a_finger_never_lost(events):
    lease, now_s, lost = JogLease(), 0.0, set()
    seen: dict[str, float] = {}
    for event, finger, later_s in events:
        now_s += later_s
        lost |= {one for one, at_s in seen.items() if now_s - at_s > LEASE_S}
        if event == "hold":
            lease.hold(1, "x+", finger, now_s)
            seen.setdefault(finger, now_s)
        elif event == "beat":
            lease.beat(finger, now_s)
            if finger in seen and finger not in lost:
                seen[finger] = now_s
        elif event == "release":
            lease.release(finger)
            lost.add(finger)
        hold = lease.held(now_s)
        if hold is not None:
            assert hold.finger not in lost
            assert now_s - hold.seen_s <= LEASE_S


JOG = ["robot", "jog", "--keys", "--box", "30"]


def at_the_pad(robot, script):
    """Jog by hand, by a script with the tablet; leave after it. Return the exit code."""
    simulator, _clock, url = robot

    def play(tablet):
        to_the_jog(tablet)
        script(tablet, Hand(tablet, InProcessEyes(simulator)))
        tablet.press("leave")
        tablet.body(EndView)
        tablet.press("finish")

    return at_the_wire(["-c", url, *JOG], play)[0]


def steps_in(simulator):
    return simulator.machine.arm.moves_started


def settled(tablet, simulator, rest_s=0.6):
    """Wait until no more steps are made; return how many there are."""
    count = steps_in(simulator)
    end_s = time.monotonic() + rest_s
    while time.monotonic() < end_s:
        tablet.read()
        if steps_in(simulator) != count:
            count, end_s = steps_in(simulator), time.monotonic() + rest_s
    return count


def hold(tablet, axis="z+", finger="f1", number=None):
    number = tablet.view.number if number is None else number
    tablet.send({"t": "hold", "number": number, "axis": axis, "finger": finger})


def beat_for(tablet, seconds, finger="f1"):
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        tablet.send({"t": "beat", "finger": finger})
        tablet.read(0.1)


def test_a_held_key_steps_while_it_beats_and_makes_one_step_at_most_after_any_loss(robot):
    simulator, *_ = robot
    after: dict[str, tuple[int, int]] = {}

    def lost(name, tablet, how):
        finger = f"finger {name}"
        hold(tablet, "z+" if len(after) % 2 == 0 else "z-", finger)
        beat_for(tablet, 0.7, finger)
        before = steps_in(simulator)
        how(finger)
        made = settled(tablet, simulator)
        after[name] = (before, made)
        # Beats that come later move nothing, nor does the same finger again.
        beat_for(tablet, 0.3, finger)
        hold(tablet, "z+", finger)
        beat_for(tablet, 0.3, finger)
        assert settled(tablet, simulator, 0.3) == made, name

    def script(tablet, _hand):
        begun = steps_in(simulator)
        lost("lifted", tablet, lambda one: tablet.send({"t": "release", "finger": one}))
        assert steps_in(simulator) - begun >= 3, "a held key repeats"
        lost("silent", tablet, lambda _one: None)
        lost("stuck", tablet, lambda _one: time.sleep(1.2))
        lost("second finger", tablet, lambda _one: hold(tablet, "x+", "another"))
        lost("another question", tablet, lambda _one: hold(tablet, "x+", "third", number=1))

    assert at_the_pad(robot, script) == 0
    for name, (before, made) in after.items():
        assert made - before <= 1, (name, after)


def test_a_step_is_as_long_as_the_chosen_one_and_half_a_millimetre_at_most(robot):
    simulator, *_ = robot
    seen = {}

    def script(tablet, hand):
        for index, size in enumerate(("5", "0.1")):
            tablet.press("size", size)
            tablet.see(lambda view, size=size: view.body.pad.size == float(size))
            before, count = hand.left_mm()["z"], steps_in(simulator)
            hold(tablet, "z+", f"f{index}")
            beat_for(tablet, 0.5, f"f{index}")
            tablet.send({"t": "release", "finger": f"f{index}"})
            made = settled(tablet, simulator) - count
            seen[size] = abs(hand.left_mm()["z"] - before) / made

    at_the_pad(robot, script)
    assert seen["5"] == pytest.approx(0.5, abs=0.05)
    assert seen["0.1"] == pytest.approx(0.1, abs=0.03)


def test_a_key_held_for_another_question_moves_nothing(robot):
    simulator, *_ = robot

    def script(tablet, _hand):
        before = steps_in(simulator)
        for step, (number, axis) in enumerate(
            itertools.product((0, 1, 999), ("z+", "x-", "v+", "", "z+5"))
        ):
            hold(tablet, axis, f"f{step}", number=number)
            beat_for(tablet, 0.02, f"f{step}")
        hold(tablet, "w+", "last")
        beat_for(tablet, 0.5, "last")
        assert settled(tablet, simulator, 0.3) == before

    at_the_pad(robot, script)


def test_a_held_key_ends_at_the_limit_and_the_measurement_goes_on(robot):
    """Steps that are refused one after the other would end the question as useless answers."""
    simulator, *_ = robot

    def script(tablet, hand):
        tablet.press("size", "5")
        tablet.see(lambda view: view.body.pad.size == 5.0)
        for _ in range(60):
            before = steps_in(simulator)
            tablet.press("jog", "z+5")
            if settled(tablet, simulator, 0.2) == before:
                break
        before = steps_in(simulator)
        for finger in range(12):
            hold(tablet, "z+", f"f{finger}")
            beat_for(tablet, 0.4, f"f{finger}")
            if finger % 4 == 3:
                tablet.press("jog", "z-0.1")
                settled(tablet, simulator, 0.2)
        assert isinstance(tablet.view.body, TouchView)
        assert tablet.left is None
        hand.tap("z-0.5")
        assert steps_in(simulator) > before

    at_the_pad(robot, script)


def test_a_wire_that_ends_ends_what_is_held(robot):
    simulator, _, url = robot
    counts = []

    def play(tablet):
        to_the_jog(tablet)
        hold(tablet)
        beat_for(tablet, 0.5)
        counts.append(steps_in(simulator))
        tablet.wire.shutdown(socket.SHUT_RDWR)

    code, tablet = at_the_wire(["-c", url, *JOG], play)
    assert isinstance(tablet, Tablet)
    assert code == 9
    assert steps_in(simulator) - counts[0] <= 1
