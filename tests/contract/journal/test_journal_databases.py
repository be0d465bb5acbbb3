"""The journal's promises about controllers and robots, the same on SQLite and PostgreSQL."""

from itertools import pairwise
from typing import Any

import pytest

from robolink.errors import LeaseHeldError, RemoteProtocolError, TransportTimeoutError
from robolink.journal import ChainVerification, LeaseHolder
from robolink.journal.store.migrations import MIGRATIONS
from robolink.model import EntryKind, Identity, NewEntry, Signature
from tests.contract.journal._acts import marker, run
from tests.contract.journal.conftest import ONE_DATABASE

# The journal's promises, the same on an SQLite file and on PostgreSQL.

CELLS = ("cell-a", "cell-b")


def test_an_entry_comes_back_with_every_field(journal):
    signature = Signature(*(f"{number} 机器人" for number in range(10)))
    details = {"value": {"x_mm": 1.25, "u_deg": -0.1}, "was": None, "flags": [True, "ä\x00\ud800"]}
    new = NewEntry(EntryKind.DONE, "change", "operation", 3, "0.0005 mm", "equal", details)
    journal.log(CELLS[0], signature=signature).append(new)
    (entry,) = journal.entries()
    fields = ("kind", "change", "operation", "tool", "tolerance", "verdict", "details")
    assert all(getattr(entry, name) == getattr(new, name) for name in fields)
    assert (entry.number, entry.controller, entry.signature) == (1, CELLS[0], signature)
    assert entry.at.endswith("+00:00")
    assert entry.previous == ""
    assert journal.verify() == ChainVerification(1, ())
    assert journal.entry(1) == entry
    assert journal.entry(2) is None


def test_text_that_no_database_stores_is_written_out(journal):
    journal.log("cell\x00\ud800").append(NewEntry(EntryKind.RAW, verdict="a\x00b\udcff"))
    (entry,) = journal.entries(controller="cell\x00\ud800")
    assert (entry.controller, entry.verdict) == ("cell\\x00\\ud800", "a\\x00b\\udcff")
    assert journal.verify().problems == ()


def test_each_entry_holds_the_hash_of_the_one_before(journal):
    for cell in CELLS * 2:
        journal.log(cell).append(*[NewEntry(EntryKind.RAW)] * 3)
    entries = list(journal.entries(newest_first=False))
    assert [entry.number for entry in entries] == list(range(1, 13))
    assert all(after.previous == before.hash for before, after in pairwise(entries))


QUESTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"controller": "cell-a"},
    {"tool": 3},
    {"controller": "cell-b", "tool": 2},
    {"change": "c1"},
    {"change": ""},
    {"kinds": (EntryKind.DONE, EntryKind.WRITE)},
    {"before": 570, "after": 100},
    {"controller": "cell-a", "kinds": (EntryKind.DONE,), "tool": 1, "change": "c2"},
)


def test_what_is_asked_for_is_found_in_either_order_and_up_to_the_limit(journal):
    kinds = list(EntryKind)
    for cell, many in zip(CELLS, (550, 50), strict=True):
        journal.log(cell).append(
            *(
                NewEntry(kinds[n % 5], change=("", "c1", "c2")[n % 3], tool=(None, 1, 2, 3)[n % 4])
                for n in range(many)
            )
        )
    everything = list(journal.entries(newest_first=False))
    assert len(everything) == journal.count() == 600

    for question in QUESTIONS:
        wanted = [entry for entry in everything if is_wanted(entry, **question)]
        assert wanted, question
        assert list(journal.entries(**question, newest_first=False)) == wanted
        assert list(journal.entries(**question)) == wanted[::-1]
        for limit in (0, 1, 7, 501):
            assert list(journal.entries(**question, limit=limit)) == wanted[::-1][:limit]


def is_wanted(entry, *, before=9999, after=0, kinds=tuple(EntryKind), **equal):
    return (
        all(getattr(entry, name) == value for name, value in equal.items())
        and entry.kind in kinds
        and after < entry.number < before
    )


def test_the_last_proved_value_is_found_behind_many_other_entries(journal):
    log = journal.log(CELLS[0])
    log.append(NewEntry(EntryKind.READ_BACK, tool=3, details={"value": 7}))
    log.append(*[NewEntry(EntryKind.VERIFY, tool=3)] * 600)
    journal.log(CELLS[1]).append(NewEntry(EntryKind.DONE, tool=3, details={"value": 8}))
    assert journal.last_value(CELLS[0], 3).number == 1
    assert journal.last_value(CELLS[0], 4) is None


@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        ("UPDATE entries SET verdict = 'x' WHERE number = 2", "Entry 2 was changed"),
        ("UPDATE entries SET tool = 5 WHERE number = 2", "Entry 2 was changed"),
        ("DELETE FROM entries WHERE number = 2", "Entry 2 is missing"),
        ("DELETE FROM entries WHERE number > 1", "Entries 2 to 3 are missing"),
    ],
)
def test_what_was_changed_or_removed_is_named(journal, statement, problem):
    journal.log(CELLS[0]).append(*[NewEntry(EntryKind.RAW)] * 3)
    run(journal, statement)
    (found,) = journal.verify().problems
    assert found.startswith(problem)


# A controller is recorded under the name that it reports, on both databases.

BY_NAME = "epson+tcp://cell-5.plant:5000"
BY_ADDRESS = "epson+tcp://192.168.0.1:5000"
PLACE = "epson@192.168.0.1:5000"
ROBOT_A, ROBOT_B = "epson:RC1/T6-1", "epson:RC2/T6-2"
BENT = "epson:RB1/T6-1"


def met(journal, name, address=BY_NAME, *, certain=True, **options):
    """Return the log of a controller that was met at an address."""
    log = journal.log(address, **options)
    log.ask(lambda: Identity(name, address, PLACE, certain=certain))
    return log


def verdicts(journal, kind=EntryKind.IDENTITY):
    return [entry.verdict for entry in journal.entries(kinds=[kind])]


def test_every_address_of_a_controller_leads_to_its_markers_and_its_record(journal):
    met(journal, ROBOT_A).begin(marker("a"))
    log = met(journal, ROBOT_A, BY_ADDRESS)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert [entry.kind for entry in log.recorded(tool=3)] == [EntryKind.INTENT]
    for name in (ROBOT_A, BY_NAME, BY_ADDRESS):
        assert len(list(journal.entries(controller=name, tool=3))) == 1
        assert [known.operation for known in journal.log(name).open_markers()] == ["a"]
    assert set(journal.addresses_of(ROBOT_A)) == {BY_NAME, BY_ADDRESS}


def test_the_lease_of_a_controller_is_one_whatever_the_address(journal):
    log = met(journal, ROBOT_A, holder=LeaseHolder(host="pc-1", pid=1, boot="b"))
    other = met(journal, ROBOT_A, BY_ADDRESS, holder=LeaseHolder(host="pc-1", pid=2, boot="b"))
    with log.hold("a calibration"), pytest.raises(LeaseHeldError, match="a calibration"):
        other.begin(marker("b"))


def test_the_same_address_with_another_controller_shows_nothing_of_the_first(journal):
    met(journal, ROBOT_A).begin(marker("a"))
    log = met(journal, ROBOT_B)
    assert log.open_markers() == ()
    (remark,) = log.remarks
    assert ROBOT_A in remark
    assert ROBOT_B in remark
    assert verdicts(journal) == [remark]
    # And back again, once.
    first = met(journal, ROBOT_A)
    assert [known.operation for known in first.open_markers()] == ["a"]
    assert len(first.remarks) == 1
    again = met(journal, ROBOT_A)
    assert len(again.open_markers()) == 1
    assert again.remarks == ()


@ONE_DATABASE
def test_another_address_of_a_known_controller_is_said_once(journal):
    met(journal, ROBOT_A).open_markers()
    for expected in (1, 0):
        log = met(journal, ROBOT_A, BY_ADDRESS)
        log.open_markers()
        assert len(log.remarks) == expected
    (said,) = verdicts(journal)
    assert BY_NAME in said
    assert BY_ADDRESS in said


def test_what_stands_under_the_text_of_an_address_belongs_to_who_answers_there(journal):
    old = journal.log(BY_NAME)
    old.begin(marker("a"))
    old.append(NewEntry(EntryKind.DONE, tool=3, details={"value": [1]}))
    old.close()
    log = met(journal, ROBOT_A)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert log.names == (ROBOT_A, BY_NAME)
    assert journal.last_value(ROBOT_A, 3).details["value"] == [1]
    log.clear("a", NewEntry(EntryKind.DECISION))
    assert journal.open_markers() == ()
    assert journal.verify().problems == ()
    # The entries were claimed: another controller at that address gets none of them.
    assert met(journal, ROBOT_B).names == (ROBOT_B,)


@ONE_DATABASE
def test_a_lease_under_the_text_of_an_address_goes_with_it(journal):
    journal.log(BY_NAME, holder=LeaseHolder(host="pc-1", pid=1, boot="b")).begin(marker("a"))
    log = met(journal, ROBOT_A, holder=LeaseHolder(host="pc-1", pid=2, boot="b"))
    with pytest.raises(LeaseHeldError):
        log.begin(marker("b"))


@ONE_DATABASE
def test_an_identity_that_becomes_known_takes_over_what_its_place_had(journal):
    met(journal, PLACE).begin(marker("a"))
    log = met(journal, ROBOT_A)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert log.remarks == ()
    assert [known for known, _ in journal.open_markers()] == [ROBOT_A]


@ONE_DATABASE
def test_a_port_that_the_system_lends_passes_nothing_on(journal):
    lent = "epson+tcp://127.0.0.1:40001"
    journal.log(lent).begin(marker("a"))
    assert met(journal, ROBOT_A, lent).open_markers() == ()
    kept = "epson+tcp://127.0.0.1:5000"
    journal.log(kept).begin(marker("b"))
    assert [m.operation for m in met(journal, ROBOT_A, kept).open_markers()] == ["b"]


@ONE_DATABASE
def test_who_is_too_busy_to_tell_is_taken_for_whom_it_was_and_asked_again(journal):
    met(journal, ROBOT_A).begin(marker("a"))
    told = [
        Identity(PLACE, BY_NAME, PLACE, certain=False),
        *[Identity(ROBOT_B, BY_NAME, PLACE)] * 2,
    ]
    log = journal.log(BY_NAME)
    log.ask(lambda: told.pop(0))
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert journal.addresses_of(ROBOT_A) == (BY_NAME,)
    assert log.open_markers() == ()
    assert log.identity == ROBOT_B


def told_in_turn(journal, *names):
    """Return the log of a controller that reports these names in turn, and the names left."""
    untold = [Identity(name, BY_NAME, PLACE, certain=name != PLACE) for name in names]
    log = journal.log(BY_NAME)
    log.ask(lambda: untold.pop(0))
    return log, untold


@ONE_DATABASE
def test_a_controller_is_not_asked_before_it_must_be_and_once_where_it_is_on_record(journal):
    for spare in (1, 2):
        log, untold = told_in_turn(journal, *[ROBOT_A] * 3)
        log.beat()
        log.close()
        assert len(untold) == 3
        log.begin(marker("a"))
        log.clear("a")
        log.open_markers()
        assert len(untold) == spare


@ONE_DATABASE
@pytest.mark.parametrize("before", ["", ROBOT_A, ROBOT_B])
@pytest.mark.parametrize("told", [(BENT, ROBOT_A, ROBOT_A), (ROBOT_A, BENT, ROBOT_A)])
def test_a_name_that_came_bent_hides_nothing_from_the_next_run(journal, before, told):
    if before:
        met(journal, before).open_markers()
    log, _ = told_in_turn(journal, *told)
    log.begin(marker("a"))
    assert log.identity == ROBOT_A
    assert [known.operation for known in met(journal, ROBOT_A).open_markers()] == ["a"]
    assert not any(BENT in verdict for verdict in verdicts(journal))


@ONE_DATABASE
def test_a_controller_that_never_tells_the_same_name_twice_is_no_controller_on_record(journal):
    log, _ = told_in_turn(journal, ROBOT_A, BENT, ROBOT_B, ROBOT_A, ROBOT_A)
    with pytest.raises(RemoteProtocolError, match=f"{ROBOT_A}, {BENT}, {ROBOT_B}"):
        log.begin(marker("a"))
    assert journal.open_markers() == ()
    assert journal.addresses_of(ROBOT_A) == ()
    log.begin(marker("a"))
    assert [known for known, _ in journal.open_markers()] == [ROBOT_A]


@ONE_DATABASE
def test_a_name_that_a_busy_controller_does_not_tell_again_is_not_yet_its_name(journal):
    log, untold = told_in_turn(journal, ROBOT_A, PLACE, PLACE, ROBOT_A, ROBOT_A)
    log.open_markers()
    assert journal.addresses_of(ROBOT_A) == ()
    assert log.identity == ROBOT_A
    assert untold == []


@ONE_DATABASE
def test_a_link_that_fails_while_asking_records_nothing(journal):
    def who():
        raise TransportTimeoutError("silence", remedy="none")

    log = journal.log(BY_NAME)
    log.ask(who)
    with pytest.raises(TransportTimeoutError):
        log.begin(marker("a"))
    assert journal.open_markers() == ()


@ONE_DATABASE
def test_a_place_that_says_nothing_of_itself_is_told_once(journal):
    for expected in (1, 0):
        log = met(journal, PLACE)
        log.open_markers()
        assert len(log.remarks) == expected
    assert verdicts(journal) == []


def test_a_reader_sees_both_names_and_stores_nothing(location, journal, open_anew):
    journal.log(BY_NAME).begin(marker("a"))
    reader = open_anew(location, read_only=True)
    log = met(reader, ROBOT_A)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert journal.addresses_of(ROBOT_A) == ()


def test_a_journal_without_names_is_read_as_it_is_and_then_brought_up_to_date(
    location, open_anew, monkeypatch
):
    with monkeypatch.context() as patched:
        patched.setattr("robolink.journal.store.migrations.MIGRATIONS", MIGRATIONS[:1])
        older = open_anew(location)
        run(older, "INSERT INTO markers VALUES ('" + BY_NAME + "', 'a', 1, 'set', 'r', 't', '{}')")
    reader = open_anew(location, read_only=True)
    assert [known.operation for known in reader.log(BY_NAME).open_markers()] == ["a"]
    assert list(reader.entries(controller=BY_NAME)) == []
    present = open_anew(location)
    assert [known.operation for known in met(present, ROBOT_A).open_markers()] == ["a"]
    assert present.verify().problems == ()


# Each robot of one controller has its own record, on both databases.

URL = "epson+tcp://cell-5.plant:5000"
ALONE = "epson:RC1/T6-1"
SECOND = "epson:RC1/C8-2"
BOTH = "epson:RC1/T6-1+C8-2"
ROBOTS = (ALONE, SECOND)


def robots_met(journal, robot="", name=BOTH, *, robots=ROBOTS):
    """Return the log of a controller with one of its robots selected."""
    log = journal.log(URL)
    log.ask(lambda: Identity(name, URL, PLACE, robot=robot, robots=robots if robot else ()))
    return log


def kept(value):
    return NewEntry(EntryKind.DONE, tool=1, details={"value": [value]})


def values(log):
    return [entry.details["value"] for entry in log.recorded(tool=1, kinds=[EntryKind.DONE])]


def test_tool_1_of_each_robot_is_another_tool(journal):
    for robot, value in zip(ROBOTS, (1, 2), strict=True):
        robots_met(journal, robot).append(kept(value))
    for robot, value in zip(ROBOTS, (1, 2), strict=True):
        log = robots_met(journal, robot)
        assert (values(log), log.identity, log.robot) == ([[value]], BOTH, robot)
        assert journal.last_value(robot, 1).details["value"] == [value]
    # The controller's own name and its address show both records.
    for name in (BOTH, URL):
        assert len(list(journal.entries(controller=name, tool=1))) == 2
    assert robots_met(journal, ALONE).remarks == ()
    assert journal.verify().problems == ()


@ONE_DATABASE
def test_what_one_robot_left_open_holds_for_the_controller_and_names_the_robot(journal):
    robots_met(journal, SECOND).begin(marker("a"))
    log = robots_met(journal, ALONE)
    (known,) = log.open_markers()
    assert known.details == {"robot": SECOND, "tool": 3}
    assert list(log.recorded(tool=3)) == []
    robots_met(journal, SECOND).clear("a", kept(5))
    assert log.open_markers() == ()
    assert values(robots_met(journal, SECOND)) == [[5]]


@ONE_DATABASE
def test_a_robot_that_was_alone_keeps_its_record_when_another_comes(journal):
    log = robots_met(journal, name=ALONE)
    log.append(kept(1))
    log.begin(marker("a"))
    log.close()
    second = robots_met(journal, SECOND)
    assert [known.operation for known in second.open_markers()] == ["a"]
    assert values(second) == []
    assert values(robots_met(journal, ALONE)) == [[1]]
    second.clear("a")
    assert journal.open_markers() == ()
    # The same after the second robot has gone again.
    assert values(robots_met(journal, name=ALONE)) == [[1]]


@ONE_DATABASE
def test_another_robot_in_force_is_another_record_from_then_on(journal):
    log = robots_met(journal, ALONE)
    log.append(kept(1))
    log.ask(lambda: Identity(BOTH, URL, PLACE, robot=SECOND, robots=ROBOTS))
    assert values(log) == []
    log.append(kept(2))
    assert journal.last_value(SECOND, 1).details["value"] == [2]


@ONE_DATABASE
@pytest.mark.parametrize("reading", [False, True])
def test_a_shared_record_of_before_is_lost_to_nobody_and_taken_for_nobodys(
    location, open_anew, monkeypatch, reading
):
    with monkeypatch.context() as patched:
        patched.setattr("robolink.journal.store.migrations.MIGRATIONS", MIGRATIONS[:2])
        older = open_anew(location)
        log = robots_met(older, name=BOTH)
        log.append(kept(1))
        log.begin(marker("a"))
        before = [entry.number for entry in older.entries()]
    present = open_anew(location, read_only=reading)
    log = robots_met(present, SECOND)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert values(log) == []
    assert {entry.number for entry in present.entries(controller=URL)} >= set(before)
    assert present.verify().problems == ()
    said = [text for text in log.remarks if "now has a record of its own" in text]
    assert len(said) == (0 if reading else 1)
    log = robots_met(present, ALONE)
    log.open_markers()
    assert log.remarks == ()
