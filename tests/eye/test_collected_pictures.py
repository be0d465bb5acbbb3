"""Pictures that a site collected are held to the limits of drawn ones (docs/reference/eye.md).

``ROBOLINK_EYE_PICTURES=FOLDER pytest tests/eye`` reads such a folder; none is shipped.
"""

import os
from datetime import UTC, datetime
from pathlib import Path

import pytest

from robolink.eye.cameras.decoding import decoded
from robolink.eye.candidate import TipShape
from robolink.eye.record.collection import (
    FinderAnswer,
    MarkedTip,
    read_collection,
    save_collected,
    tally,
)
from robolink.eye.tip_finder import find_tips
from tests.eye._drawn_tips import drawn_tip

FOLDER = os.environ.get("ROBOLINK_EYE_PICTURES", "")
MOST_SHARES = {FinderAnswer.WRONG: 1 / 500, FinderAnswer.NONE: 0.03, FinderAnswer.SEVERAL: 0.03}
FEWEST = 50
"""Pictures below which their number says nothing about a promise."""


def beyond_limits(folder: Path) -> list[str]:
    """Return what exceeds a limit, with the pictures."""
    pictures = read_collection(folder)
    found = tally(pictures, lambda one: find_tips(decoded(one.path.read_bytes(), ""), one.shape))
    return [
        f"{answer}: {len(found[answer])} of {len(pictures)}: {[one.name for one in found[answer]]}"
        for answer, share in MOST_SHARES.items()
        if len(found[answer]) > share * len(pictures)
    ]


@pytest.mark.skipif(not FOLDER, reason="ROBOLINK_EYE_PICTURES names no folder of real pictures")
@pytest.mark.timeout(900)
def test_the_finder_keeps_its_limits_on_collected_pictures():
    folder = Path(FOLDER)
    assert beyond_limits(folder) == []
    count = len(read_collection(folder))
    assert count >= FEWEST, f"{count} pictures; a promise takes {FEWEST}"


@pytest.fixture
def folder(tmp_path):
    """A folder with two tips and a picture without one."""
    for number, (x, radius) in enumerate([(150.0, 22.0), (170.0, 24.0), (0.0, 0.0)]):
        tips = [MarkedTip(x, 120.0, radius)] if radius else []
        save(tmp_path, drawn_tip(x, radius_px=radius, seed=number), tips)
    return tmp_path


def save(folder, grey, tips):
    save_collected(
        folder,
        grey,
        tips,
        shape=TipShape(22.0),
        at=datetime(2026, 11, 30, tzinfo=UTC),
        camera="drawn",
        candidates=(),
        robolink_version="0",
    )


def test_a_folder_of_good_pictures_passes(folder):
    assert beyond_limits(folder) == []


def test_a_tip_that_is_told_and_not_there_exceeds_the_limit(folder):
    """The other ways of being wrong are those of test_collection.py."""
    save(folder, drawn_tip(), [MarkedTip(140.0, 120.0, 22.0)])
    (said,) = beyond_limits(folder)
    assert said.startswith("wrong: 1 of 4")
    assert "20261130-000000-4.png" in said


def test_a_tip_that_is_not_found_exceeds_the_limit(folder):
    save(folder, drawn_tip(radius_px=0.0), [MarkedTip(160.0, 120.0, 22.0)])
    (said,) = beyond_limits(folder)
    assert said.startswith("none: 1 of 4")
