"""The fixture ``epson_replay``, as used in third-party tests."""

import pytest

import robolink
from robolink.timing import wall_label
from robolink.transport import DialogueLog, format_dialogue

pytest_plugins = ["pytester"]

TESTS = """
import robolink
from pathlib import Path

DAY = Path("day.jsonl").absolute()

def test_the_same(epson_replay):
    with robolink.connect(epson_replay(DAY)) as c:
        assert c.status().ready

def test_more(epson_replay):
    with robolink.connect(epson_replay(DAY)) as c:
        c.status(), c.status()

def test_less(epson_replay):
    with robolink.connect(epson_replay(DAY)):
        pass

def test_nothing(epson_replay):
    epson_replay(DAY)
"""


@pytest.fixture
def recorded(pytester, monkeypatch):
    """A recording of one status request in the folder of the inner test."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(pytester.path / "state"))
    log = DialogueLog("a simulator", wall_label())
    with robolink.connect("epson+sim://replay-fixture", trace=log) as controller:
        assert controller.status().ready
    (pytester.path / "day.jsonl").write_text(format_dialogue(log.dialogue))
    return pytester


def test_a_replay_fails_the_test_that_asks_otherwise(recorded):
    recorded.makepyfile(TESTS)
    result = recorded.runpytest_inprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=4, errors=3)
    *_, shown = result.stdout.str().partition("= ERRORS =")
    _, more, less, nothing = shown.split("ERROR at teardown of test_")
    assert "Request 4 differs" in more
    assert "Logout" in more.partition("was sent, but")[2]
    assert "GetStatus" in more.partition("was sent, but")[0]
    assert "Request 3 differs" in less
    assert "Logout" in less.partition("was sent, but")[0]
    assert "GetStatus" in less.partition("was sent, but")[2]
    assert "1 recorded connections were not made" in nothing
    assert [part.partition(" ")[0] for part in (more, less, nothing)] == ["more", "less", "nothing"]
