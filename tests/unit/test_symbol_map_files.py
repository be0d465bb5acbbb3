"""Map files of symbols: every fault is reported with the path of its key."""

from pathlib import Path

import pytest

from robolink.errors import ConfigError
from robolink.register_maps import (
    MapValue,
    NumberType,
    SymbolCell,
    check_map,
    load_map,
    load_symbol_map,
    to_compare,
)
from tests._rows import each_row

GOOD = """
schema = "robolink/plc-map/1"
name = "test"
[numbers]
root = "ns=4;s=|var|PLC.GVL."
type = "LREAL"
[[tools]]
number = 1
node = "aTool1"
length = 6
x = { element = 0 }
y = { element = 2, scale = 0.001, type = "int32" }
[commit]
kind = "commit_bit"
trigger = { node = "xTrigger" }
done = { node = "wState", bit = 3 }
"""
ROOT = "ns=4;s=|var|PLC.GVL."


@pytest.fixture
def write(tmp_path):
    def written(text):
        path = tmp_path / "machine.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def said(problems):
    return {problem.where: problem.what for problem in problems}


def test_elements_of_an_array_are_places(write):
    found = load_symbol_map(write(GOOD))
    x, y = (found.slots[1].components[name] for name in "xy")
    assert x.cell == SymbolCell(f"{ROOT}aTool1", (0,))
    assert (y.type, y.factor, y.length) == (NumberType.INT32, 0.001, 6)
    assert x.place == f"{ROOT}aTool1, element 0"
    assert found.commit.answer is not None
    assert found.commit.answer.place == f"{ROOT}wState bit 3"
    assert found.cycle_ms == 100
    assert found.writable
    counted = GOOD + '[cycle_counter]\nnode = "udiCycle"\n'
    assert load_symbol_map(write(counted)).cycle_ms == 0
    assert (
        load_symbol_map(write(counted.replace("[numbers]", "cycle_ms = 40\n[numbers]"))).cycle_ms
        == 40
    )


def test_whole_ids_and_ways_need_no_root(write):
    text = GOOD.replace('"aTool1"', '"ns=4;i=1003"').replace('"xTrigger"', '"/DeviceSet/PLC/xT"')
    found = load_symbol_map(write(text))
    assert found.slots[1].nodes == ("ns=4;i=1003",)
    assert found.commit.request is not None
    assert found.commit.request.cell.node == "/DeviceSet/PLC/xT"


def test_fields_of_structures_and_of_their_arrays_are_places(write):
    text = GOOD.replace("length = 6\nx = { element = 0 }", 'x = { field = "stTip.aValue[2]" }')
    text = text.replace(
        'y = { element = 2, scale = 0.001, type = "int32" }', 'y = { field = "rY" }'
    )
    found = load_symbol_map(write(text))
    assert found.slots[1].components["x"].cell.steps == ("stTip", "aValue", 2)
    assert found.slots[1].components["x"].place == f"{ROOT}aTool1, field stTip.aValue[2]"
    one = text.replace('node = "aTool1"', 'node = "aTools"\nelement = 3\nlength = 4')
    found = load_symbol_map(write(one))
    assert found.slots[1].components["y"].cell.steps == (3, "rY")
    assert found.slots[1].components["y"].place == f"{ROOT}aTools, field [3].rY"


@each_row(
    ("old", "new", "where", "what"),
    [
        ("element = 0", "element = 6", "tools#1.x.element", "less than 6"),
        ("length = 6\n", "", "tools#1.x.length", "how many elements"),
        ("element = 0", 'field = "1x"', "tools#1.x.field", "name of a field"),
        ("element = 0", 'field = "a..b"', "tools#1.x.field", "name of a field"),
        ("element = 0", 'field = "[1]"', "tools#1.x.field", "name of a field"),
        ("element = 2", "element = 0", "tools#1.y", "same place as tools#1.x"),
        ('node = "aTool1"\n', "", "tools#1.x.node", "name the node"),
        ('root = "ns=4;s=|var|PLC.GVL."\n', "", "tools#1.x.node", "must begin with ns="),
        ('type = "LREAL"', "", "tools#1.x.type", "is missing"),
        ('{ node = "xTrigger" }', '{ node = "wOut", bit = 2 }', "commit.trigger", "of its own"),
        ('{ node = "xTrigger" }', '{ node = "a", on = 0 }', "commit.trigger", "on and off"),
        ('"wState", bit = 3', '"xTrigger"', "commit.done", "same place as commit.trigger"),
        ('"wState", bit = 3', '"wState", bit = 32', "commit.done.bit", "at most 31"),
        ("[commit]", "cycle_ms = 5\n[commit]", "tools#1.cycle_ms", "not known"),
        ("[numbers]", "cycle_ms = 0\n[numbers]", "cycle_ms", "more than 0"),
        ("element = 0", "element = 0, length = 5", "tools#1.y", "another length"),
        ("element = 0", 'element = 0, unit = "deg"', "tools#1.x.unit", "must be one of"),
        ("[commit]", '[probe]\nnode = "r"\nvalue = 0\n[commit]', "probe.value", "must not be 0"),
        ("number = 1", "number = 1\nv = { element = 4 }", "tools#1", "state rotation"),
        ('kind = "commit_bit"', 'kind = "commit_bit"\nerorr = 1', "commit.erorr", "mean error"),
    ],
)
def test_each_fault_is_told_with_its_key(write, old, new, where, what):
    assert old in GOOD
    problems = said(check_map(write(GOOD.replace(old, new, 1))))
    assert what in problems.get(where, ""), problems


def test_a_map_is_of_registers_or_of_symbols(write):
    mixed = GOOD.replace('{ node = "xTrigger" }', '{ table = "coil", address = 3 }')
    ((where, what),) = said(check_map(write(mixed))).items()
    assert where == ""
    assert "commit.trigger" in what
    assert "numbers.root" in what
    with pytest.raises(ConfigError, match="names symbols, not registers"):
        load_map(write(GOOD))


def test_a_map_of_registers_is_no_map_of_symbols():
    with pytest.raises(ConfigError, match="names registers, not symbols"):
        load_symbol_map(Path("examples/plc-maps/commit-bit.toml"))


def tools(text):
    return GOOD.replace("[commit]", text + "[commit]")


def test_tools_that_are_laid_out_alike_are_compared_once_and_others_apart(write):
    second = '[[tools]]\nnumber = 2\nnode = "aTool2"\nlength = 6\nx = { element = %d }\n'
    second += 'y = { element = %d, scale = 0.001, type = "int32" }\n'
    alike = load_symbol_map(write(tools(second % (1, 3))))
    wanted = [str(one.value) for one in to_compare(alike, {}, {})]
    assert wanted == ["1.x", "1.y", "2.x"]
    other = load_symbol_map(write(tools(second % (3, 1))))
    assert len(to_compare(other, {}, {})) == 4


def test_separate_nodes_are_alike_by_their_names_but_for_the_number_of_the_tool(write):
    begin, end = GOOD.index("[[tools]]"), GOOD.index("[commit]")
    named = '[[tools]]\nnumber = {0}\nx = {{ node = "{1}" }}\ny = {{ node = "{2}" }}\n'

    def wanted(*names):
        text = "".join(named.format(n, *pair) for n, pair in enumerate(names, start=1))
        found = load_symbol_map(write(GOOD[:begin] + text + GOOD[end:]))
        return [one.value for one in to_compare(found, {}, {})]

    alike = wanted(("rTool1X", "rTool1Y"), ("rTool2X", "rTool2Y"))
    assert alike == [MapValue(1, "x"), MapValue(1, "y"), MapValue(2, "x")]
    exchanged = wanted(("rTool1X", "rTool1Y"), ("rTool2Y", "rTool2X"))
    assert len(exchanged) == 4
    assert len(wanted(("rTool1X", "rTool1Y"), ("rTool12X", "rTool12Y"))) == 4
