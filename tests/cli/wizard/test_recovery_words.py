"""The page of a recovery says in words what was begun; requests of the wire are for records."""

import pytest

from robolink.model import Marker, MarkerKind, begun_in_words

TARGET = [164.588, 497.136, -93.572, 90.0, 0.0, 0.0]
WIRE = "Go XY(164.588, 497.136, -93.572, 90.000) /R /0"


@pytest.mark.parametrize(
    ("kind", "details", "words"),
    [
        (
            MarkerKind.MOVE,
            {"target": TARGET},
            "a movement to X 164.588 Y 497.136 Z -93.572 U 90.000",
        ),
        (MarkerKind.MOVE, {"duration_s": 0.4}, "a movement"),
        (MarkerKind.SET, {"tool": 3, "requested": TARGET}, "writing tool 3"),
        (MarkerKind.SET, {"tool": 3, "requested": None}, "clearing tool 3"),
        (MarkerKind.SET, {"select": 0, "before": 1}, "selecting tool 0"),
        (MarkerKind.CHANGE, {"tools": {}}, WIRE),
    ],
)
def test_a_movement_is_told_by_where_it_was_to_go(kind, details, words):
    assert begun_in_words(Marker("1", kind, WIRE, "2026-11-23T14:02:00Z", details)) == words
