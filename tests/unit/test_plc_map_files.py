"""Map files: everything that is wrong is told, with the path of its key."""

import subprocess
import sys
from pathlib import Path

import pytest

from robolink.errors import ConfigError
from robolink.register_maps import (
    AllZero,
    CommitKind,
    NumberType,
    RegisterTable,
    check_map,
    load_map,
)

GOOD = """
schema = "robolink/plc-map/1"
name = "test"
[numbers]
type = "REAL"
word_order = "low_first"
[[tools]]
number = 1
x = { address = 10 }
y = { address = 12 }
[commit]
kind = "none"
"""

EXAMPLES = sorted(Path("examples/plc-maps").glob("*.toml"))


@pytest.fixture
def write(tmp_path):
    def written(text):
        path = tmp_path / "machine.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def said(problems):
    return {problem.where: problem.what for problem in problems}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_are_right(path):
    assert check_map(path) == ()


def test_the_three_examples_show_the_three_handshakes():
    assert {load_map(path).commit.kind for path in EXAMPLES} == set(CommitKind)


@pytest.mark.fault("F39")
def test_units_scales_and_defaults_end_in_millimetres_and_degrees(write):
    text = GOOD.replace('type = "REAL"', 'type = "REAL"\nscale = 2.0\nlength_unit = "um"')
    text = text.replace(
        "y = { address = 12 }",
        'y = { address = 12, unit = "inch", scale = 1 }\n'
        'u = { address = 14, type = "int16", unit = "rad", scale = 0.5 }',
    )
    slot = load_map(write(text)).slots[1]
    assert slot.components["x"].factor == pytest.approx(0.002)
    assert slot.components["y"].factor == 25.4
    assert slot.components["u"].factor == pytest.approx(28.6478897565)
    assert slot.components["u"].type is NumberType.INT16
    assert slot.contiguous


def test_a_map_says_what_is_known_of_its_file(write):
    path = write(GOOD)
    found = load_map(path)
    assert (found.name, found.all_zero, found.writable) == ("test", AllZero.REFUSE, True)
    changed = load_map(write(GOOD + "# a remark\n"))
    assert changed.sha256 != found.sha256


def test_tools_in_input_registers_can_only_be_read(write):
    found = load_map(write(GOOD.replace('type = "REAL"', 'type = "REAL"\ntable = "input"')))
    assert found.slots[1].table is RegisterTable.INPUT
    assert not found.writable


BAD = {
    "a key that is mistyped": (
        GOOD.replace("x = {", "xx = {").replace("adress", "address"),
        "tools#1.xx",
        "is x meant",
    ),
    "no type": (GOOD.replace('type = "REAL"\n', ""), "tools#1.x.type", "missing, here and in"),
    "no word order": (
        GOOD.replace('word_order = "low_first"\n', ""),
        "tools#1.x.word_order",
        "missing, here and in",
    ),
    "an address beyond the end": (
        GOOD.replace("address = 12", "address = 65535"),
        "tools#1.y",
        "ends beyond address 65535",
    ),
    "a negative address": (
        GOOD.replace("address = 12", "address = -1"),
        "tools#1.y.address",
        "at least 0",
    ),
    "numbers that overlap": (
        GOOD.replace("address = 12", "address = 11"),
        "tools#1.y",
        "overlaps tools#1.x at 40012 (address 11)",
    ),
    "a gap without a handshake": (
        GOOD.replace("address = 12", "address = 20"),
        "tools#1",
        "gaps between its registers",
    ),
    "two tables": (
        GOOD.replace("{ address = 12", '{ table = "input", address = 12'),
        "tools#1",
        "in two tables",
    ),
    "too far apart": (
        GOOD.replace("address = 12", "address = 200"),
        "tools#1",
        "one request reads at most 125",
    ),
    "an angle in millimetres": (
        GOOD.replace("y = { address = 12 }", 'u = { address = 12, unit = "mm" }'),
        "tools#1.u.unit",
        "one of deg, rad",
    ),
    "a scale of 0": (
        GOOD.replace("address = 12 ", "address = 12, scale = 0.0 "),
        "tools#1.y.scale",
        "must not be 0",
    ),
    "v without what rotations mean": (
        GOOD.replace("y = { address = 12 }", "v = { address = 12 }"),
        "tools#1",
        "Rz(U) Ry(V) Rx(W)",
    ),
    "no component": (
        GOOD.replace("x = { address = 10 }\ny = { address = 12 }\n", ""),
        "tools#1",
        "names no component",
    ),
    "a tool twice": (
        GOOD.replace("[commit]", "[[tools]]\nnumber = 1\nx = { address = 30 }\n[commit]"),
        "tools#2.number",
        "is given twice",
    ),
    "no commit": (GOOD.replace('[commit]\nkind = "none"\n', ""), "commit", 'kind = "commit_bit"'),
    "an unknown handshake": (GOOD.replace('"none"', '"maybe"'), "commit", "commit_bit"),
    "a trigger that is one bit of a register": (
        GOOD.replace(
            'kind = "none"',
            'kind = "commit_bit"\ntrigger = { table = "holding", address = 40, bit = 1 }\n'
            'done = { table = "input", address = 0 }',
        ),
        "commit.trigger",
        "whole holding register",
    ),
    "a handshake without its answer": (
        GOOD.replace('kind = "none"', 'kind = "level"\nrequest = { table = "coil", address = 4 }'),
        "commit.acknowledge",
        "is missing",
    ),
    "a bit of a coil": (
        GOOD + '[permit]\ntable = "coil"\naddress = 1\nbit = 2\n',
        "permit",
        "single bit",
    ),
    "a signal inside a number": (
        GOOD + '[permit]\ntable = "holding"\naddress = 13\n',
        "permit",
        "overlaps tools#1.y",
    ),
    "a probe that tells nothing": (
        GOOD + "[probe]\naddress = 90\nvalue = 0.0\n",
        "probe.value",
        "does not tell the word order",
    ),
    "another schema": (
        GOOD.replace("plc-map/1", "plc-map/2"),
        "schema",
        "robolink/plc-map/1",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_told_with_its_path(write, case):
    text, where, what = BAD[case]
    path = write(text)
    problems = said(check_map(path))
    assert what in problems[where], problems
    with pytest.raises(ConfigError, match="Nothing was sent") as refused:
        load_map(path)
    assert where in str(refused.value)


def test_all_problems_are_told_at_once(write):
    text = GOOD.replace("address = 12", "address = 11").replace("address = 10", "address = 70000")
    assert len(said(check_map(write(text)))) == 1  # what pydantic finds comes first
    text = GOOD + "[probe]\naddress = 12\nvalue = 0.0\n"
    assert set(said(check_map(write(text)))) == {"probe", "probe.value"}


def test_signals_that_are_only_read_may_share_a_register():
    assert load_map(Path("examples/plc-maps/level-handshake.toml")).commit.busy is not None


@pytest.mark.parametrize("content", [b"\xff\xfe", b"tools = [", b"x = " + b"[" * 3000])
def test_a_file_that_is_no_toml_is_refused(tmp_path, content):
    path = tmp_path / "machine.toml"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match="cannot be read"):
        load_map(path)
    with pytest.raises(ConfigError, match="cannot be read"):
        load_map(tmp_path / "missing.toml")


def test_who_names_a_map_does_not_wait_for_pydantic():
    look = "import sys, robolink.register_maps; sys.exit('pydantic' in sys.modules)"
    subprocess.run([sys.executable, "-c", look], check=True)
