"""sim softmotion --kinematics: what TAB offers, near misses, and a class in the present folder."""

import sys
from pathlib import Path

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.simulate.sim import softmotion

EXAMPLES = Path(__file__).parents[2] / "examples" / "kinematics"


def refusal(capsys, *more):
    code = main.run(["sim", "softmotion", "--modbus-tcp", "127.0.0.1:0", *more])
    return code, capsys.readouterr().err


@pytest.mark.parametrize(
    ("start", "offered"),
    [
        ("Kin_P", ["Kin_Polar", "Kin_Polar_Z", "Kin_Pos_RRR"]),
        ("kin_gantry3+kin_c", ["Kin_Gantry3+Kin_CAxis", "Kin_Gantry3+Kin_CAxis_Tool"]),
    ],
)
def test_tab_completes_the_names_of_kinematics(start, offered):
    option = next(it for it in softmotion.params if it.name == "kinematics")
    context = click.Context(softmotion)
    assert [it.value for it in option.shell_complete(context, start)] == offered


def test_a_name_that_is_nearly_right_is_told_the_right_one(capsys):
    code, told = refusal(capsys, "--kinematics", "Kin_Scara3Z")
    assert code == 2
    assert "Is Kin_Scara3_Z meant?" in told


def test_what_cannot_move_by_itself_says_so_by_its_name(capsys):
    code, told = refusal(capsys, "--kinematics", "Kin_Wrist2")
    assert code == 2
    assert "Kin_Wrist2 turns the flange of another kinematics" in told


def test_a_class_is_found_in_the_present_folder(capsys, monkeypatch):
    monkeypatch.setattr(sys, "path", [it for it in sys.path if it])
    monkeypatch.chdir(EXAMPLES)
    named = ("--kinematics", "double_scara:DoubleScara")
    try:
        code, told = refusal(capsys, *named, "--param", "length=1")
        assert code == 2
        assert "has no parameter length" in told
        assert "inner, outer" in told
        code, told = refusal(capsys, *named, "--param", "outer=60")
        assert code == 2
        assert "The outer arms do not meet" in told
    finally:
        sys.modules.pop("double_scara", None)
