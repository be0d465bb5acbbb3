"""Every movement of the shipped recipes is proved on the wire, however a controller prints lists.

The judge is held to its own promises: from a log that has all of them, one is taken at a time.
"""

from dataclasses import replace
from functools import cache

import pytest
from robolink_simulators.epson.options import EpsonOptions

from tests.contract._epson_wire_promises import Speeds, broken_promises, movements
from tests.contract._shipped_cells import touched

pytestmark = pytest.mark.simulator_only

SPEEDS = {
    "scara-pin": Speeds(5, {20.0}),
    "two-nozzles": Speeds(5, {20.0}),
    "needle-beams": Speeds(10, {60.0, 8.0}),
}
MOST_REQUESTS = {"needle-beams": 450}


@pytest.fixture(scope="module")
def log_of(tmp_path_factory):
    """Return the log of a change by a recipe, made once for the module."""

    @cache
    def changed(example, comma="numeric"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("ROBOLINK_STATE_DIR", str(tmp_path_factory.mktemp(example)))
            with touched(f"{example}.toml", options=EpsonOptions(comma_blank=comma)) as cell:
                done = cell.change(*cell.words)
                assert done.code == 0, done.err
                return tuple(cell.simulator.log)

    return changed


@pytest.mark.parametrize(
    ("example", "comma"),
    [
        ("scara-pin", "numeric"),
        ("needle-beams", "numeric"),
        ("scara-pin", "nothing"),
        pytest.param("two-nozzles", "numeric", marks=pytest.mark.soak),
        pytest.param("needle-beams", "nothing", marks=pytest.mark.soak),
        pytest.param("needle-beams", "comma", marks=pytest.mark.soak),
        pytest.param("needle-beams", "tab", marks=pytest.mark.soak),
        pytest.param("needle-beams", "always", marks=pytest.mark.soak),
    ],
)
def test_every_movement_of_a_recipe_is_proved(log_of, example, comma):
    log = log_of(example, comma)
    assert movements(log) > 25
    assert broken_promises(log, SPEEDS[example]) == []
    requests = sum(direction == ">" for _, direction, _ in log)
    assert comma == "nothing" or requests <= MOST_REQUESTS.get(example, requests)


@pytest.mark.soak
@pytest.mark.parametrize("example", ["scara-pin", "needle-beams"])
def test_every_movement_keeps_the_acceleration_that_the_cell_states(tmp_path, monkeypatch, example):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    stated, before = 150, (5000.0, 4000.0, 300.0, 250.0, 200.0, 99.0)
    with touched(f"{example}.toml") as cell:
        files = tmp_path / "robolink.toml"
        confirmed = 'remote_timeout_s = 60\nremote_timeout_confirmed_by = "a test"\n'
        lines = f'[cells.a]\nurl = "{cell.url}"\n{confirmed}acceleration_mm_s2 = {stated}\n'
        files.write_text(lines, encoding="utf-8")
        monkeypatch.setenv("ROBOLINK_CONFIG", str(files))
        cell.simulator.machine.parameters.accel_s = before
        done = replace(cell, url="a").change(*cell.words)
        assert done.code == 0, done.out
        log = list(cell.simulator.log)
        assert cell.simulator.machine.parameters.accel_s == before
    assert movements(log) > 20
    assert broken_promises(log, replace(SPEEDS[example], mm_s2=stated)) == []
    assert sum('"AccelS ' in text for _, _, text in log) == 2
    requests = sum(direction == ">" for _, direction, _ in log)
    assert requests <= MOST_REQUESTS.get(example, requests)


LOOK, POSE, MOVE = "Print Tool, Motor", "RealPos", '"Move '


def last(log, text, before=None):
    """Return the place of the last request with a text, before a place."""
    end = len(log) if before is None else before
    return max(n for n, (_, way, what) in enumerate(log[:end]) if way == ">" and text in what)


def without(log, text):
    """Leave out a request before the last straight movement, and its answer."""
    at = last(log, text, last(log, MOVE))
    return log[:at] + log[at + 2 :]


def answered(log, old, new):
    """Change the answer to the look before the last straight movement."""
    at = last(log, LOOK, last(log, MOVE)) + 1
    at_ns, way, text = log[at]
    assert old in text
    return [*log[:at], (at_ns, way, text.replace(old, new, 1)), *log[at + 1 :]]


def inserted(log, request, answer, text):
    """Put another exchange in front of a request before the last straight movement."""
    at = last(log, text, last(log, MOVE) + 1)
    return [*log[:at], (log[at][0], ">", request), (log[at][0], "<", answer), *log[at:]]


def unwatched(log):
    """Leave out all looks at the flags."""
    at = {n + k for n, (_, _, text) in enumerate(log) if text == "$GetStatus" for k in (0, 1)}
    return [line for n, line in enumerate(log) if n not in at]


@pytest.mark.parametrize(
    ("spoilt", "why"),
    [
        (lambda log: without(log, LOOK), "not read: Motor"),
        (lambda log: without(without(log, POSE), POSE), "was not looked at"),
        (lambda log: answered(log, '"0 1 0', '"2 1 0'), "tool 2 was read, 0 was selected"),
        (lambda log: answered(log, " 1 0 ", " 0 0 "), "the motors are off"),
        (lambda log: answered(log, " 1 0 ", " 1 1 "), "power is high"),
        (lambda log: answered(log, " 20 ", " 200 "), "speed 200 mm/s"),
        (lambda log: inserted(log, "$Abort", "#Abort,0", LOOK), "were not set anew"),
        (lambda log: inserted(log, '$Execute,"SpeedS 9.0"', "#Execute,0", MOVE), "not read: Tool"),
        (unwatched, "nobody looked for"),
    ],
)
def test_the_judge_finds_each_promise_that_is_missing(log_of, spoilt, why):
    good = list(log_of("scara-pin", "numeric"))
    assert broken_promises(good, SPEEDS["scara-pin"]) == []
    found = broken_promises(spoilt(good), SPEEDS["scara-pin"])
    assert any(why in line for line in found), found
