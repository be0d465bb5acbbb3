"""Twenty tables as people have them, unedited, with the poses that they stand for.

They are not part of the source archive; the tests skip where the folder is absent.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from robolink.calibration import rotation_of
from robolink.errors import AmbiguousPosesError
from robolink.pose_tables import ReadingChoices, read_poses

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "pose_tables"
LIST = DATA / "expected.json"

pytestmark = pytest.mark.skipif(
    not LIST.is_file(), reason="the tables lie beside the repository and are not there"
)
EXPECTED = json.loads(LIST.read_text(encoding="utf-8"))["files"] if LIST.is_file() else {}


@pytest.mark.parametrize("name", EXPECTED)
def test_a_table_holds_the_poses_that_it_stands_for(name):
    wanted = EXPECTED[name]
    found = read_poses(DATA / name, ReadingChoices(**wanted["options"]))
    assert len(found.entries) == len(wanted["poses"])
    for entry, one in zip(found.entries, wanted["poses"], strict=True):
        pose = entry.pose
        place = (pose.x_mm, pose.y_mm, pose.z_mm)
        assert place == pytest.approx((one["x"], one["y"], one["z"]), abs=1e-6)
        assert np.allclose(rotation_of(pose).ravel(), one["r"], rtol=0, atol=1e-6)
        known = {
            "name": entry.name,
            "number": entry.number,
            "hand": pose.hand,
            "local": pose.local,
            "tool": pose.tool,
        }
        for key in known.keys() & one.keys():
            assert known[key] == one[key]


@pytest.mark.parametrize("name", [name for name in EXPECTED if EXPECTED[name]["options"]])
def test_without_what_it_does_not_say_a_table_is_refused_with_that_question(name):
    with pytest.raises(AmbiguousPosesError) as caught:
        read_poses(DATA / name)
    assert set(caught.value.asks) == set(EXPECTED[name]["options"])
