"""Names that entries of before gave to calibration methods."""

from robolink.calibration import solve_two_pose
from robolink.methods import method_names
from robolink.model import Pose, finding_named_now, method_name_now, with_method_name_now
from robolink.model import _journal_entries as former


def test_what_was_written_before_is_the_name_of_a_method():
    assert {*former._FORMER.values()} <= {*method_names()}
    assert not {*former._FORMER} & {*method_names()}


def test_what_is_no_name_of_before_stays():
    assert method_name_now("plate-touch") == "plate-touch"
    assert with_method_name_now({"method": 3, "tip": []}) == {"method": 3, "tip": []}
    assert with_method_name_now({"tip": []}) == {"tip": []}
    assert finding_named_now("up_camera with tool 2") == "camera with tool 2"
    assert finding_named_now("") == ""


def test_a_solver_that_is_used_alone_names_its_method_too():
    result = solve_two_pose(Pose(287.5, 103.25, 0, 0), Pose(312.5, 96.75, 0, 180))
    assert result.method == "two-pose"
