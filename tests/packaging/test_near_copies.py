"""One message is one sentence: no two of the catalogue say the same in other words."""

import pytest

from tests.packaging._near_copies import near_copies, reviewed, sentences


def test_no_sentence_is_all_but_a_copy_of_another():
    """A pair that is meant to differ goes into ``near_copies.txt``; else one of the two goes."""
    found = set(near_copies(sentences()))
    assert len(found & reviewed()) > 50, "the search finds nothing, or the list is of another day"
    assert sorted(found - reviewed()) == []


@pytest.mark.parametrize(
    "other",
    [
        "Check the cable and the controller's power, then try again.",
        "Check the cable and the controller's power, then connect.",
        "Check cable and the controller's power, then connect once again.",
    ],
)
def test_a_near_copy_is_found(other):
    sentence = "Check the cable and the controller's power, then connect again."
    assert list(near_copies([sentence, other])) == [tuple(sorted((sentence, other)))]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Tool {tool} was written and read back.", "Tool {other} was written and read back."),
        ("the file is not there", "the file is not here"),
        ("Nothing was sent. Name another file of poses.", "Nothing was sent. Press the switch."),
    ],
)
def test_other_values_labels_and_other_sentences_are_none(one, other):
    assert list(near_copies([one, other])) == []
