"""The fixture ``epson_replay``, as the tests of somebody else use it."""

import pytest
import sqlalchemy.dialects.sqlite  # noqa: F401 - see below

import robolink
from robolink.timing import wall_label
from robolink.transport import DialogueLog, format_dialogue

# It forgets what is imported while it runs, and SQLAlchemy does not bear to be imported twice.
pytest_plugins = ["pytester"]

TEST = """
import robolink
from pathlib import Path

def test_it(epson_replay):
    url = epson_replay(Path("day.jsonl"))
    {body}
"""


@pytest.fixture
def recorded(pytester, monkeypatch):
    """A recording of one status in the folder of the inner test."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(pytester.path / "state"))
    log = DialogueLog("a simulator", wall_label())
    with robolink.connect("epson+sim://replay-fixture", trace=log) as controller:
        assert controller.status().ready
    (pytester.path / "day.jsonl").write_text(format_dialogue(log.dialogue))
    return pytester


@pytest.mark.parametrize(
    ("body", "outcome", "said"),
    [
        ("with robolink.connect(url) as c: assert c.status().ready", {"passed": 1}, "*1 passed*"),
        (
            "with robolink.connect(url) as c: c.status(), c.status()",
            {"passed": 1, "errors": 1},
            "*Request 4 differs*GetStatus* was sent, but *Logout* was recorded*",
        ),
        (
            "with robolink.connect(url) as c: pass",
            {"passed": 1, "errors": 1},
            "*Request 3 differs*Logout* was sent, but *GetStatus* was recorded*",
        ),
        ("pass", {"passed": 1, "errors": 1}, "*1 recorded connections were not made*"),
    ],
    ids=["the same", "more", "less", "nothing"],
)
def test_a_replay_fails_the_test_that_asks_otherwise(recorded, body, outcome, said):
    recorded.makepyfile(TEST.format(body=body))
    result = recorded.runpytest_subprocess("-p", "no:cacheprovider")
    result.stdout.fnmatch_lines([said])
    result.assert_outcomes(**outcome)
