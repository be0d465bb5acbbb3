"""``robolink demo --operator``: a careful person gets a new tool, a careless one a refusal."""

import json

import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.demo import (
    AcceptedChange,
    DemoOperator,
    require_refused,
)
from robolink_cli.commands.simulate.demo import _on_plc as on_plc

STORED = {"x_mm": 12.0, "y_mm": -3.5, "z_mm": -20.0}


def test_a_careful_person_is_believed_and_a_believed_one_is_no_refusal():
    change = on_plc(2, DemoOperator.CAREFUL)
    assert isinstance(change, AcceptedChange)
    assert change.error_mm < 0.05
    with pytest.raises(RuntimeError, match="was believed, on Kin_Scara3_Z"):
        require_refused([change])


@pytest.mark.soak
def test_who_stands_there_is_said_in_the_document(capsys):
    assert main.run(["demo", "--json", "--speed", "100", "--operator", "careful"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["operator"] == "careful"
    assert [one["refused"] for one in document["controllers"]] == [None, None]


@pytest.mark.parametrize("seed", [1, pytest.param(3, marks=pytest.mark.soak)])
def test_a_careless_person_is_refused_and_the_old_tool_stays_in_force(capsys, seed):
    words = ("demo", "--speed", "100", "--operator", "careless", "--seed", str(seed))
    assert main.run([*words, "--json"]) == 0
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    assert document["operator"] == "careless"
    assert [one["kind"] for one in document["controllers"]] == ["epson", "softmotion"]
    for one in document["controllers"]:
        assert one["refused"]["code"] == "not_touched"
        assert "recovered" not in one
        assert {name: one["in_force"][name] for name in STORED} == pytest.approx(STORED)
        assert abs(one["truth"]["x_mm"] - STORED["x_mm"]) > 0.1
    assert "only presses Enter" in shown.err
    assert shown.err.count("Refused: ") == 2
    assert shown.err.count("still holds X 12.000 Y -3.500 Z -20.000") == 2
