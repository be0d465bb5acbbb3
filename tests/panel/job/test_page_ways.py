"""What a page shows in place of a command."""

import json
import socket

import pytest
from robolink_cli.wizard.faces.link import WireLink
from robolink_cli.wizard.views.page_ways import on_a_page

from robolink.locale.languages import speak
from robolink.messages import install, tr


@pytest.fixture
def chinese():
    speak("zh")
    yield
    install(None)


RECOVER = "'Finish or undo the interrupted job' on this page"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Next: robolink recover.", f"Next: {RECOVER}."),
        ('Next: robolink -c "line 3" recover', f"Next: {RECOVER}"),
        ("Next: robolink -c epson+tcp://10.0.0.1:5000 recover", f"Next: {RECOVER}"),
        (
            "When the cell is clear, run 'robolink robot release'.",
            "When the cell is clear, run 'Allow movement again after a stop' on this page.",
        ),
        ("Next: robolink change", "Next: 'Change a needle or nozzle' on this page"),
        ("Next: robolink change needle.toml", "Next: 'Change a needle or nozzle' on this page"),
        (
            "Next: robolink -c line3 cell station learn PIN-07",
            "Next: 'Find the station PIN-07 again' on this page",
        ),
        (
            "Next: robolink robot reset, then robolink recover.",
            f"Next: robolink robot reset, then {RECOVER}. Type commands at the panel's computer.",
        ),
        (
            "Next: robolink status",
            "Next: robolink status. Type commands at the panel's computer.",
        ),
        ("one\nNext: robolink recover\ntwo", f"one\nNext: {RECOVER}\ntwo"),
        # It does something else than the job of the page, or is no command.
        (
            "robolink recover --forget drops it.",
            "robolink recover --forget drops it. Type commands at the panel's computer.",
        ),
        ("robolink did not repeat it.", "robolink did not repeat it."),
        ("robolink recovers nothing.", "robolink recovers nothing."),
        ("The tip is 0.01 mm off.", "The tip is 0.01 mm off."),
    ],
)
def test_a_job_of_the_page_stands_for_its_command(text, shown):
    assert on_a_page(text) == shown


def test_the_same_in_chinese(chinese):
    said = on_a_page(tr("Next: {command}", command="robolink -c line3 recover"))
    assert "robolink" not in said
    assert tr("Finish or undo the interrupted job") in said
    assert "robolink" in on_a_page("\u6267\u884c 'robolink robot reset'\u3002")
    assert "robolink" not in on_a_page("\u6267\u884c 'robolink robot release'\u3002")


def test_what_a_press_brings_back_stays_as_it_is():
    ours, theirs = socket.socketpair()
    link = WireLink(theirs)
    with ours:
        link.send({"text": "Next: robolink recover", "rows": [{"value": "robolink recover"}]})
        link.close()
        said = json.loads(ours.makefile().readline())
    assert said == {"text": f"Next: {RECOVER}", "rows": [{"value": "robolink recover"}]}
