"""Values in JSON and back: each class by its annotations."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Self

import pytest

from robolink.messages import Translated
from robolink.model import Hand, Pose, from_fields, json_fields, json_value
from tests._rows import each_row


@dataclass(frozen=True)
class Row:
    name: str
    u_mm: float
    kind: Literal["A", "B"] = "B"


@dataclass(frozen=True)
class Shared:
    """A class that writes and reads itself."""

    parts: int

    def as_json(self):
        return {"percent": self.parts * 10}

    @classmethod
    def from_json(cls, document) -> Self:
        return cls(document["percent"] // 10)


@dataclass(frozen=True)
class Sheet:
    rows: tuple[Row, ...]
    points_mm: Sequence[tuple[float, ...]]
    hand: Hand | None
    share: Shared
    count: int = 1
    sure: bool = False

    @property
    def total_mm(self):
        return sum(row.u_mm for row in self.rows)


SHEET = Sheet((Row("pin", 0.04), Row("touch", 0.03, "A")), ((1.0, 2.0),), Hand.LEFT, Shared(3))


def test_a_value_comes_back_from_its_json():
    document = json.loads(json.dumps(json_value(SHEET)))
    assert document["rows"][1] == {"name": "touch", "u_mm": 0.03, "kind": "A"}
    assert (document["share"], document["hand"]) == ({"percent": 30}, "left")
    assert from_fields(Sheet, document) == SHEET


def test_keys_stand_in_the_order_in_which_they_are_named():
    found = json_fields(SHEET, "total_mm", "hand", right="sure")
    assert list(found.items()) == [("total_mm", 0.07), ("hand", "left"), ("right", False)]


def test_json_has_no_infinity_and_keeps_sentences_as_they_are():
    sentence = Translated("schief", "leaning")
    found = json_value({"nu": math.inf, "said": (sentence, math.nan, 2, True, None)})
    assert found == {"nu": None, "said": ["schief", None, 2, True, None]}
    assert found["said"][0] is sentence


def test_what_json_cannot_hold_is_refused():
    with pytest.raises(TypeError, match="object"):
        json_value({"tool": object()})


@each_row(
    ("change", "error"),
    [
        ({"rows": [{"name": "pin", "u_mm": 0.04}]}, KeyError),
        ({"rows": [{"name": "pin", "u_mm": "wide", "kind": "B"}]}, ValueError),
        ({"rows": None}, TypeError),
        ({"hand": "both"}, ValueError),
    ],
)
def test_what_is_no_such_value_is_never_guessed(change, error):
    document: Mapping[str, object] = {**json_value(SHEET), **change}
    with pytest.raises(error):
        from_fields(Sheet, document)


def test_a_record_of_before_keeps_defaults_only_where_that_is_asked_for():
    old = {"x_mm": 1, "y_mm": 2, "z_mm": 3, "u_deg": 4}
    with pytest.raises(KeyError):
        from_fields(Pose, old)
    assert from_fields(Pose, old, partial=True) == Pose(1, 2, 3, 4)
    with pytest.raises(TypeError):
        from_fields(Pose, {"x_mm": 1}, partial=True)
