"""A controller is on record under what it says of itself, on both databases."""

import pytest

from robolink.errors import LeaseHeldError, TransportTimeoutError
from robolink.journal import LeaseHolder
from robolink.journal.store.migrations import MIGRATIONS
from robolink.model import EntryKind, Identity, NewEntry
from tests.contract.journal._acts import marker, run

BY_NAME = "epson+tcp://cell-5.plant:5000"
BY_ADDRESS = "epson+tcp://192.168.0.1:5000"
PLACE = "epson@192.168.0.1:5000"
ROBOT_A, ROBOT_B = "epson:RC1/T6-1", "epson:RC2/T6-2"


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
    # It was claimed: who answers there later gets none of it.
    assert met(journal, ROBOT_B).names == (ROBOT_B,)


def test_a_lease_under_the_text_of_an_address_goes_with_it(journal):
    journal.log(BY_NAME, holder=LeaseHolder(host="pc-1", pid=1, boot="b")).begin(marker("a"))
    log = met(journal, ROBOT_A, holder=LeaseHolder(host="pc-1", pid=2, boot="b"))
    with pytest.raises(LeaseHeldError):
        log.begin(marker("b"))


def test_an_identity_that_becomes_known_takes_over_what_its_place_had(journal):
    met(journal, PLACE).begin(marker("a"))
    log = met(journal, ROBOT_A)
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert log.remarks == ()
    assert [known for known, _ in journal.open_markers()] == [ROBOT_A]


def test_a_port_that_the_system_lends_passes_nothing_on(journal):
    lent = "epson+tcp://127.0.0.1:40001"
    journal.log(lent).begin(marker("a"))
    assert met(journal, ROBOT_A, lent).open_markers() == ()
    kept = "epson+tcp://127.0.0.1:5000"
    journal.log(kept).begin(marker("b"))
    assert [m.operation for m in met(journal, ROBOT_A, kept).open_markers()] == ["b"]


def test_who_is_too_busy_to_tell_is_taken_for_whom_it_was_and_asked_again(journal):
    met(journal, ROBOT_A).begin(marker("a"))
    told = [Identity(PLACE, BY_NAME, PLACE, certain=False), Identity(ROBOT_B, BY_NAME, PLACE)]
    log = journal.log(BY_NAME)
    log.ask(lambda: told.pop(0))
    assert [known.operation for known in log.open_markers()] == ["a"]
    assert journal.addresses_of(ROBOT_A) == (BY_NAME,)
    assert log.open_markers() == ()
    assert log.identity == ROBOT_B


def test_a_controller_is_asked_once_and_not_before_it_must_be(journal):
    asked = []

    def who():
        asked.append(1)
        return Identity(ROBOT_A, BY_NAME, PLACE)

    log = journal.log(BY_NAME)
    log.ask(who)
    log.beat()
    log.close()
    assert asked == []
    log.begin(marker("a"))
    log.clear("a")
    log.open_markers()
    assert asked == [1]


def test_a_link_that_fails_while_asking_records_nothing(journal):
    def who():
        raise TransportTimeoutError("silence", remedy="none")

    log = journal.log(BY_NAME)
    log.ask(who)
    with pytest.raises(TransportTimeoutError):
        log.begin(marker("a"))
    assert journal.open_markers() == ()


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
