"""A person reads the time of the place with its zone; records keep UTC."""

import re
import time
from pathlib import Path

import pytest

from robolink.timing import local_label

ROOT = Path(__file__).parents[2]

RAW = re.compile(
    r"\b(?:when|at|since)=[\w.]*\.(?:begun_at|taken_at|found_at)\b|\{[\w.]*\.begun_at\}"
)
"""A recorded label as it is, in a sentence."""


@pytest.fixture
def zone(monkeypatch):
    if not hasattr(time, "tzset"):
        pytest.skip("the zone of a process cannot be set here")

    def choose(name):
        monkeypatch.setenv("TZ", name)
        time.tzset()

    yield choose
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("CET-1", "2026-11-23 14:58 (UTC+1)"),
        ("CST-8", "2026-11-23 21:58 (UTC+8)"),
        ("UTC0", "2026-11-23 13:58 (UTC)"),
        ("<+0530>-5:30", "2026-11-23 19:28 (UTC+5:30)"),
        ("<-0330>3:30", "2026-11-23 10:28 (UTC-3:30)"),
        ("<+14>-14", "2026-11-24 03:58 (UTC+14)"),
    ],
)
def test_a_label_is_shown_as_the_clock_on_the_wall_shows_it(zone, name, shown):
    zone(name)
    assert local_label("2026-11-23T13:58:04+00:00") == shown
    assert local_label("2026-11-23T13:58:04.120Z") == shown


@pytest.mark.parametrize("label", ["", "yesterday", "2026-11-23T13:58:04", "0001-01-01T00:00Z"])
def test_what_is_no_time_is_shown_as_it_is(zone, label):
    zone("EST5")
    assert local_label(label) == label


def test_no_sentence_shows_a_recorded_label_as_it_is():
    assert RAW.search('tr("since {when}", when=marker.begun_at)')
    for folder in ("robolink", "cli"):
        for path in (ROOT / folder).rglob("*.py"):
            assert not RAW.search(path.read_text(encoding="utf-8")), path
