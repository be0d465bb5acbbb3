"""The note that a stop leaves: in doubt it stands, and it hangs on its own controller."""

import json

import pytest

from robolink.files.durable import file_name, state_folder
from robolink.journal._lease_view import LeaseHolder, LeaseView
from robolink.stopping import clear_note, find_note, leave_note

URL = "epson+tcp://192.168.0.1:5000"
HERE = {"192.168.0.1:5000"}
pytestmark = pytest.mark.usefixtures("robolink_state")


def path_of(key):
    return state_folder("stops") / file_name(key)


def test_a_note_that_cannot_be_read_is_a_note_all_the_same():
    path_of(next(iter(HERE))).mkdir(parents=True)
    found = find_note(HERE)
    assert found is not None
    assert not found.confirmed
    assert "cannot be read" in found.sentence


@pytest.mark.parametrize("confirmed", ["no", 1, None, False])
def test_rest_is_believed_only_where_the_note_says_so(confirmed):
    leave_note(HERE, URL, "mei", confirmed=True)
    path = path_of(next(iter(HERE)))
    kept = json.loads(path.read_bytes())
    path.write_text(json.dumps({**kept, "confirmed": confirmed}))
    found = find_note(HERE)
    assert found is not None
    assert not found.confirmed
    assert "did not see it come to rest" in found.sentence


def test_a_note_of_another_controller_hides_none_of_this_one_and_stays():
    """They were met at one address, one after the other."""
    leave_note(HERE, URL, "mei", confirmed=True, controller="SN-1")
    leave_note({"cable"}, URL, "jan", confirmed=True, controller="SN-2")
    both = {*HERE, "cable"}
    for name, who in (("SN-1", "mei"), ("SN-2", "jan")):
        found = find_note(both, name)
        assert found is not None
        assert found.who == who
    leave_note(HERE, URL, "ada", confirmed=True, controller="SN-2")
    clear_note({"elsewhere"}, "SN-1")
    assert find_note({"elsewhere"}, "SN-1") is None
    found = find_note(HERE)
    assert found is not None
    assert found.who == "ada", "a later stop at the same address"


@pytest.mark.parametrize("record", ['{"nobody": 1}', "[]", "", "{", '"x"', "[" * 100_000])
def test_a_record_of_a_holder_that_is_damaged_names_nobody(record):
    assert LeaseView(holder=record).who() == LeaseHolder()
