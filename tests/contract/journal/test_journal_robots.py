"""Each robot of one controller has its own record, on both databases."""

import pytest

from robolink.journal.store.migrations import MIGRATIONS
from robolink.model import EntryKind, Identity, NewEntry
from tests.contract.journal._acts import marker

URL = "epson+tcp://cell-5.plant:5000"
PLACE = "epson@192.168.0.1:5000"
ALONE = "epson:RC1/T6-1"
SECOND = "epson:RC1/C8-2"
BOTH = "epson:RC1/T6-1+C8-2"
ROBOTS = (ALONE, SECOND)


def met(journal, robot="", name=BOTH, *, robots=ROBOTS):
    """Return the log of a controller with a robot in force."""
    log = journal.log(URL)
    log.ask(lambda: Identity(name, URL, PLACE, robot=robot, robots=robots if robot else ()))
    return log


def kept(value):
    return NewEntry(EntryKind.DONE, tool=1, details={"value": [value]})


def values(log):
    return [entry.details["value"] for entry in log.recorded(tool=1, kinds=[EntryKind.DONE])]


def test_tool_1_of_each_robot_is_another_tool(journal):
    for robot, value in zip(ROBOTS, (1, 2), strict=True):
        met(journal, robot).append(kept(value))
    for robot, value in zip(ROBOTS, (1, 2), strict=True):
        log = met(journal, robot)
        assert (values(log), log.identity, log.robot) == ([[value]], BOTH, robot)
        assert journal.last_value(robot, 1).details["value"] == [value]
    # The controller's own name and its address show both.
    for name in (BOTH, URL):
        assert len(list(journal.entries(controller=name, tool=1))) == 2
    assert met(journal, ALONE).remarks == ()
    assert journal.verify().problems == ()


def test_what_one_robot_left_open_holds_for_the_controller_and_names_the_robot(journal):
    met(journal, SECOND).begin(marker("a"))
    log = met(journal, ALONE)
    (known,) = log.open_markers()
    assert known.details == {"robot": SECOND, "tool": 3}
    assert list(log.recorded(tool=3)) == []
    met(journal, SECOND).clear("a", kept(5))
    assert log.open_markers() == ()
    assert values(met(journal, SECOND)) == [[5]]


def test_a_robot_that_was_alone_keeps_its_record_when_another_comes(journal):
    log = met(journal, name=ALONE)
    log.append(kept(1))
    log.begin(marker("a"))
    log.close()
    second = met(journal, SECOND)
    assert [known.operation for known in second.open_markers()] == ["a"]
    assert values(second) == []
    assert values(met(journal, ALONE)) == [[1]]
    second.clear("a")
    assert journal.open_markers() == ()
    # And when that one has gone again.
    assert values(met(journal, name=ALONE)) == [[1]]


def test_another_robot_in_force_is_another_record_from_then_on(journal):
    log = met(journal, ALONE)
    log.append(kept(1))
    log.ask(lambda: Identity(BOTH, URL, PLACE, robot=SECOND, robots=ROBOTS))
    assert values(log) == []
    log.append(kept(2))
    assert journal.last_value(SECOND, 1).details["value"] == [2]


@pytest.mark.parametrize("reading", [False, True])
def test_a_shared_record_of_before_is_lost_to_nobody_and_taken_for_nobodys(
    location, open_anew, monkeypatch, reading
):
    with monkeypatch.context() as patched:
        patched.setattr("robolink.journal.store.migrations.MIGRATIONS", MIGRATIONS[:2])
        older = open_anew(location)
        log = met(older, name=BOTH)
        log.append(kept(1))
        log.begin(marker("a"))
        before = [entry.number for entry in older.entries()]
    present = open_anew(location, read_only=reading)
    log = met(present, SECOND)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert values(log) == []
    assert {entry.number for entry in present.entries(controller=URL)} >= set(before)
    assert present.verify().problems == ()
    said = [text for text in log.remarks if "now has a record of its own" in text]
    assert len(said) == (0 if reading else 1)
    log = met(present, ALONE)
    log.open_markers()
    assert log.remarks == ()
