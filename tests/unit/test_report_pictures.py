"""Round numbers and names in the pictures of a report."""

import pytest

from robolink.report.pictures.drawing import dot_names, step_down, step_up


@pytest.mark.parametrize(
    ("value", "down", "up"), [(37.0, 30.0, 50.0), (0.72, 0.6, 1.0), (170.0, 150.0, 200.0)]
)
def test_a_scale_is_a_round_number_beside_the_value(value, down, up):
    assert step_down(value) == pytest.approx(down)
    assert step_up(value) == pytest.approx(up)


def test_a_dot_has_its_name_where_there_is_room_and_none_elsewhere():
    places = [(100.0, 100.0), *[(200.0, 200.0)] * 20]
    names = [name.text for name in dot_names(places, [f"dot {n}" for n in range(21)])]
    assert names[:2] == ["dot 0", "dot 1"]
    assert len(names) < 21
