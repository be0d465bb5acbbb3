"""Values as JSON documents and back: every public class, and refused documents."""

import copy
import itertools
import json
import math
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from enum import Enum, Flag
from types import NoneType
from typing import Any, ClassVar, Literal, cast, get_args, get_origin

import numpy as np
import pytest

from robolink import Pose, ToolOffset, from_json, model, to_json
from robolink.calibration import (
    BudgetRow,
    CalibrationResult,
    Crossing,
    ShaftSeen,
    StationPart,
    UncertaintyBudget,
    ZTouchResult,
)
from robolink.controllers import MailboxFacts
from robolink.errors import DocumentError
from robolink.model import RotationMatrix, ToolReceipt, ValueReceipt
from robolink.model._documents import members_of, schema_of, value_fields
from robolink.protocols.mailbox import Capability
from tests._json_schema import Schemas
from tests._rows import each_row
from tools import value_schemas
from tools.api import public

PUBLISHED = json.loads(value_schemas.FILE.read_text(encoding="utf-8"))
CHECK = Schemas(PUBLISHED)
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NOT_DATA = {
    "robolink.calibration.PivotDesign": "arrays",
    "robolink.calibration.PivotFit": "arrays",
    "robolink.calibration_run.Attended": "functions",
    "robolink.calibration_run.ChangePlan": "a source, which measures",
    "robolink.calibration_run.OpenTurnTest": "a proof, which moves",
    "robolink.calibration_run.ToolPlan": "a source, which measures",
    "robolink.controllers.ConnectionTerms": "a password, a clock",
    "robolink.controllers.SimpleMachine": "it changes",
    "robolink.journal.JournalCopy": "an error",
    "robolink.journal.JournalMove": "errors",
    "robolink.model.Account": "it changes",
    "robolink.stations.BeamStation": "its beams are looked up by the type checker alone",
    "robolink.transaction.PutBack": "an exception",
}


def back(value, kind=None):
    """Return the result of a value's conversion to JSON and back."""
    document = json.loads(json.dumps(to_json(value), allow_nan=False))
    return from_json(kind or type(value), document)


def sample(kind, last):
    """Return a value for an annotation: of the first member of a union, or the last."""
    members = members_of(kind)
    kind = members[-1 if last else 0]
    origin, inner = get_origin(kind), get_args(kind)
    plain: dict[Any, Any] = {
        NoneType: None,
        bool: True,
        int: 3,
        float: -0.25,
        str: "ä",
        bytes: b"\x01\xff",
    }
    plain |= {object: {"a": [1, 2.5, None]}, Any: "any"}
    if kind in plain:
        return plain[kind]
    if kind == RotationMatrix:
        return IDENTITY
    if origin is Literal:
        return inner[0]
    if origin is tuple and inner[-1] is not ...:
        return tuple(sample(one, last) for one in inner)
    if origin in (tuple, Sequence):
        return (sample(inner[0], last),) * 2
    if origin is frozenset:
        return frozenset([sample(inner[0], last)])
    if origin is Mapping:
        return {sample(inner[0], last): sample(inner[1], last)}
    if issubclass(kind, Flag):
        return ~kind(0) if last else kind(0)
    if issubclass(kind, Enum):
        return [*kind][-1]
    try:
        return kind(**{name: sample(one, last) for name, one in value_fields(kind).items()})
    except ValueError:  # a value that takes no negative numbers
        return kind()


@pytest.fixture(scope="module")
def made():
    """The schema of every public value, the classes without one, and all classes."""
    found, without = value_schemas.schemas()
    kinds = {value_schemas.key_of(it): it for it in value_schemas.values().values()}
    return found, without, {key: kinds[key] for key in found if key in kinds}


def test_the_published_schemas_are_those_of_the_classes(made):
    found, without, kinds = made
    again = "run: python -m tools.value_schemas"
    assert value_schemas.whole(PUBLISHED["$defs"], found) == PUBLISHED, again
    assert without.keys() == NOT_DATA.keys()
    assert found.keys() == kinds.keys()
    assert len(found) > 140


@pytest.mark.soak
def test_no_other_package_has_a_value_that_stands_in_a_result(made):
    others = [it for it in public() if "simulators" not in it]
    assert value_schemas.schemas(others) == made[:2]


def test_every_public_value_comes_back_equal_and_is_hashed_copied_and_pickled(made):
    for key, kind in made[2].items():
        for last in (False, True):
            value = sample(kind, last)
            document = json.loads(json.dumps(to_json(value), allow_nan=False))
            found = from_json(kind, document)
            assert (type(found), found) == (kind, value)
            assert CHECK.wrong(PUBLISHED["$defs"][key], document) == []
            for other in (
                found,
                copy.copy(value),
                copy.deepcopy(value),
                pickle.loads(pickle.dumps(value)),
            ):
                assert other == value
                assert hash(other) == hash(value)


def test_working_material_of_arrays_is_compared_without_an_error():
    fit = value_schemas.values()["robolink.calibration.PivotFit"]
    a, b = (fit(*[np.ones(3)] * len(fields(fit))) for _ in range(2))
    assert (a == b, a == a, len({a, b})) == (False, True, 2)


def test_a_list_in_a_value_is_kept_as_a_tuple():
    crossings = [sample(Crossing, last=False)]
    for value in (StationPart("pin", [[1.0, 0.0], [0.0, 1.0]]), ShaftSeen(crossings, 1.0, 2.0)):
        assert back(value) == value
        assert hash(back(value)) == hash(value)


class Ink(Enum):
    RED = (255, 0)


@dataclass(frozen=True)
class Row:
    name: str
    u_mm: float
    count: int = 1
    sure: bool = False


@dataclass(frozen=True)
class WideRow(Row):
    wide_mm: float = 0.0


@dataclass(frozen=True)
class Sheet:
    rows: tuple[Row, ...]
    by_tool: Mapping[int, Row | None]
    at: datetime
    ink: Ink | None
    data: bytes
    said: bool | int | float | str
    place: Row | ToolOffset
    details: object = None


AT = datetime(2026, 11, 29, 13, 45, tzinfo=UTC)
ROW = Row("pin", math.inf)
SHEET = Sheet((ROW, WideRow("x", -math.inf, 2)), {3: ROW, 4: None}, AT, Ink.RED, b"\0\xff", 0, ROW)


def test_what_a_value_of_another_package_holds_comes_back():
    document = to_json(SHEET)
    assert document["schema"] == "tests/value/Sheet/1"
    plain = {"name": "pin", "u_mm": "Infinity", "count": 1, "sure": False}
    assert document["rows"][0] == {"schema": "tests/value/Row/1"} | plain
    assert document["rows"][1]["schema"] == "tests/value/WideRow/1"
    assert back(SHEET) == SHEET
    for said in (True, 1, 2.5, "NaN", "1"):
        found = back(replace(SHEET, said=said, place=ToolOffset(1)))
        assert (type(found.said), found.said, found.place) == (type(said), said, ToolOffset(1))


def test_a_class_that_derives_is_read_as_its_base_too():
    assert type(back(WideRow("x", 1.0), Row)) is WideRow
    document = to_json(SHEET)["rows"][1]
    with pytest.raises(DocumentError, match="not tests/value/WideRow/1"):
        from_json(WideRow, to_json(ROW))
    with pytest.raises(DocumentError, match="Import a class of another package first"):
        from_json(Row, document | {"schema": "other_package/value/WideRow/1"})


def test_a_result_whose_class_nobody_has_loaded_is_found_in_its_package():
    kinds = value_schemas.values()
    derived = [it for it in kinds.values() if issubclass(it, CalibrationResult)]
    assert ZTouchResult in derived
    for kind in derived:
        value = sample(kind, last=True)
        assert type(back(value, CalibrationResult)) is kind


FLOATS = [np.float16, np.float32, np.float64, np.longdouble, float]
WHOLE_NUMBERS = [np.int8, np.uint8, np.int16, np.uint64, np.int64, int]


@each_row("wrap", [lambda it: it, np.array])
@each_row("number", [0.0, -0.0, 1.5, -65504.0, math.inf, -math.inf, math.nan])
def test_a_row_of_numbers_of_any_width_comes_back(number, wrap):
    for floating, whole in itertools.product(FLOATS, WHOLE_NUMBERS):
        for count in (0, 127):
            given: list[Any] = [floating(number), whole(count), np.bool_(count > 9)]
            found = back(Row("pin", *map(wrap, given)))
            assert [type(it) for it in (found.u_mm, found.count, found.sure)] == [float, int, bool]
            assert (found.count, found.sure) == (count, count > 9)
            assert repr(found.u_mm) == repr(number)


def test_a_budget_keeps_its_infinite_degrees_of_freedom():
    budget = UncertaintyBudget.of([BudgetRow("pin", 0.04)])
    assert back(budget) == budget
    assert back(budget).rows[0].nu == math.inf


WHOLE = to_json(ToolOffset(1, 2, 3))
ENDLESS: list[object] = []
ENDLESS.append(ENDLESS)


@each_row(
    ("value", "said"),
    [
        (replace(SHEET, said=math.nan), "Sheet.said holds nan"),
        (replace(SHEET, details={"a": [math.inf]}), r"Sheet.details\['a'\]\[0\] holds inf"),
        (replace(SHEET, details=object()), "Sheet.details holds <object"),
        (replace(SHEET, rows=cast("Any", np.ones(2))), "Sheet.rows holds array"),
        (replace(SHEET, by_tool=cast("Any", {"3": ROW})), "Sheet.by_tool holds '3'"),
        (Row("pin", 1.0, 1.5), "Row.count holds 1.5"),  # type: ignore[arg-type]
        (Row("pin", 2**53 + 1), "Row.u_mm holds 9007199254740993"),
        (Row("pin", 10**400), "Row.u_mm holds 1000"),
        (Row("pin", 10**5000), "Row.u_mm holds <int>"),
        (Row("pin", True), "Row.u_mm holds True"),
        (replace(SHEET, details=ENDLESS), "Sheet.details is nested too deeply"),
        (
            replace(SHEET, data=cast("Any", ["x" * 99] * 99)),
            r"Sheet.data holds \[.{0,300}\], which",
        ),
        ({"x_mm": 1}, "A dict cannot become"),
        (Row, "A type cannot become"),
    ],
)
def test_what_json_cannot_hold_is_refused_by_its_place(value, said):
    with pytest.raises(DocumentError, match=said):
        to_json(value)


@each_row(
    ("change", "said"),
    [
        ({"schema": "robolink/value/ToolOffset/2"}, "from a newer version.*Update robolink"),
        ({"schema": "robolink/value/ToolOffset/0"}, "from a newer|not robolink"),
        ({"schema": "robolink/value/ToolOffset/one"}, "not robolink/value/ToolOffset/1"),
        ({"schema": "robolink/value/ToolOffset/" + "9" * 5000}, "not robolink/value/ToolOffset/1"),
        ({"schema": "robolink/value/ToolOffset/²"}, "not robolink/value/ToolOffset/1"),
        ({"schema": "robolink/value/Pose/1"}, "is robolink/value/Pose/1, not robolink/value/ToolO"),
        ({"schema": "robolink/tool/1"}, "is robolink/tool/1, not"),
        ({"schema": 1}, "names no schema"),
        ({"x_m": 1}, "ToolOffset.x_m is not known. Did you mean x_mm"),
        ({"x_mm": "1"}, "ToolOffset.x_mm is '1'"),
        ({"x_mm": True}, "ToolOffset.x_mm is True"),
        ({"x_mm": None}, "ToolOffset.x_mm is None"),
        ({"x_mm": "NaN"}, "ToolOffset cannot be made.*\n.*x_mm is not a number"),
        ({"x_mm": 10**400}, "ToolOffset.x_mm is 1000"),
    ],
)
def test_another_document_is_refused_and_never_guessed(change, said):
    with pytest.raises(DocumentError, match=said) as caught:
        from_json(ToolOffset, WHOLE | change)
    assert caught.value.remedy


def test_a_document_that_lacks_a_key_is_refused():
    document = {key: value for key, value in WHOLE.items() if key != "w_deg"}
    with pytest.raises(DocumentError, match=r"ToolOffset\.w_deg is missing"):
        from_json(ToolOffset, document)
    inner = to_json(ToolReceipt(1, None, ToolOffset(), None))
    inner["requested"]["u"] = 1
    with pytest.raises(DocumentError, match=r"ToolReceipt\.requested\.u is not known"):
        from_json(ToolReceipt, inner)
    del inner["requested"]["u"], inner["requested"]["schema"]
    with pytest.raises(DocumentError, match=r"ToolReceipt\.requested is \{.*of another type"):
        from_json(ToolReceipt, inner)


DEEP: list[object] = []
for _ in range(100_000):
    DEEP = [DEEP]


@each_row(
    ("change", "said"),
    [
        ({"by_tool": {" 3": None}}, "Sheet.by_tool is ' 3', a value of another type"),
        ({"by_tool": {"03": None}}, "Sheet.by_tool is '03'"),
        ({"ink": "BLUE"}, "Sheet.ink is 'BLUE'"),
        ({"ink": ["RED"]}, "Sheet.ink is"),
        ({"data": "0g"}, "Sheet.data is '0g'"),
        ({"at": "yesterday"}, "Sheet.at is 'yesterday'"),
        ({"rows": {"0": None}}, "Sheet.rows is"),
        ({"details": {"a": math.nan}}, r"Sheet.details\['a'\] holds nan"),
        ({"details": DEEP}, "Sheet.details is nested too deeply"),
        ({"place": WHOLE | {"schema": "robolink/value/ToolOffset/2"}}, "from a newer version"),
        ({"place": WHOLE | {"schema": "robolink/value/Pose/1"}}, "Sheet.place is"),
        ({"place": WHOLE | {"w_deg": "1"}}, "Sheet.place.w_deg is '1'"),
    ],
)
def test_a_tampered_document_is_refused_by_the_place_of_what_is_wrong(change, said):
    with pytest.raises(DocumentError, match=said):
        from_json(Sheet, to_json(SHEET) | change)


def test_the_bits_of_a_flag_come_back_and_a_truth_value_is_none():
    facts = MailboxFacts(
        "1.0", "Kin_Scara3_Z", "", 4, 1.0, Capability.TOOLS | Capability.LATCH, 1, None
    )
    document = to_json(facts)
    assert back(facts) == facts
    for wrong in (True, -1, "TOOLS", 1.5):
        with pytest.raises(DocumentError, match=r"^MailboxFacts\.capabilities is"):
            from_json(MailboxFacts, document | {"capabilities": wrong})


@each_row("document", [None, [], "{}", 5])
def test_what_is_no_document_is_refused(document):
    with pytest.raises(DocumentError, match="names no schema"):
        from_json(ToolOffset, document)


@dataclass(frozen=True)
class Later:
    """A class that got a field after its first version."""

    json_version: ClassVar[int] = 2
    x_mm: float
    y_mm: float = 5.0


def test_an_older_document_may_lack_what_has_a_default_and_nothing_else():
    older = {"schema": "tests/value/Later/1", "x_mm": 1.0}
    assert schema_of(Later) == "tests/value/Later/2"
    assert from_json(Later, older) == Later(1.0)
    with pytest.raises(DocumentError, match="y_mm is missing"):
        from_json(Later, older | {"schema": "tests/value/Later/2"})
    with pytest.raises(DocumentError, match="x_mm is missing"):
        from_json(Later, {"schema": "tests/value/Later/1"})


@dataclass(frozen=True)
class Holder:
    """A third-party class that holds a value whose class has a later version."""

    later: Later


def test_a_value_in_a_document_is_read_by_its_own_version():
    document = to_json(Holder(Later(1.0)))
    assert document["later"] == {"schema": "tests/value/Later/2", "x_mm": 1.0, "y_mm": 5.0}
    document["later"] = {"schema": "tests/value/Later/1", "x_mm": 1.0}
    assert from_json(Holder, document) == Holder(Later(1.0))
    document["later"] |= {"schema": "tests/value/Later/3"}
    with pytest.raises(DocumentError, match="tests/value/Later/3, from a newer version"):
        from_json(Holder, document)


def test_fields_without_a_schema_are_read_for_one_more_version_with_a_warning():
    with pytest.warns(DeprecationWarning, match="now robolink.model.from_fields") as caught:
        found = model.from_json(Pose, {"x_mm": 1, "y_mm": 2, "z_mm": 3, "u_deg": 4}, partial=True)  # type: ignore[call-arg]
    assert found == Pose(1, 2, 3, 4)
    assert caught[0].filename == __file__
    with pytest.raises(DocumentError, match="names no schema"):
        from_json(ToolOffset, {"x_mm": 1})


def test_a_changed_class_needs_the_next_version(made):
    now = made[0]
    before = now | {"Drift-1": {"type": "object"}, "Gone-1": {}}
    assert value_schemas.changed(before, now) == ["Drift-1"]
    assert {"Gone-1", "Drift-1"} <= value_schemas.whole(before, now)["$defs"].keys()


def test_a_value_of_a_variable_keeps_its_type():
    for value in (True, 3, 2.5, "text"):
        receipt = back(ValueReceipt("a", value, value, value, skipped=False))
        assert {type(it) for it in (receipt.before, receipt.read_back)} == {type(value)}
