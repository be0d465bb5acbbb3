"""Map files and register lists: every fault is reported with the path of its key."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from robolink.errors import ConfigError
from robolink.register_maps import (
    AllZero,
    CommitKind,
    NumberType,
    RegisterTable,
    check_map,
    draft_from_csv,
    load_map,
    load_plc_map,
)
from robolink.register_maps._drafts import component_of
from tests._rows import each_row

# Map files: every fault is reported with the path of its key.

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


@each_row("path", EXAMPLES)
def test_the_examples_are_right(path):
    assert check_map(path) == ()


def test_the_examples_show_the_three_handshakes():
    assert {load_plc_map(path).commit.kind for path in EXAMPLES} == set(CommitKind)


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
        "did you mean x",
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
        "does not show the word order",
    ),
    "another schema": (
        GOOD.replace("plc-map/1", "plc-map/2"),
        "schema",
        "robolink/plc-map/1",
    ),
}


@each_row("case", BAD)
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
    assert len(said(check_map(write(text)))) == 1  # pydantic's findings come first
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


# Register lists as PLC programmers keep them: names, addresses, and rows that cannot be used.


def draft_of(tmp_path, text):
    path = tmp_path / "list.csv"
    path.write_text(text, encoding="utf-8")
    return draft_from_csv(path)


@each_row(
    ("name", "found"),
    [
        ("GVL.T1.x", (1, "x", "")),
        ("Application.GVL.Tool1_X", (1, "x", "")),
        ("aTool[1].rX", (1, "x", "")),
        ("Tool1.X_Offset", (1, "x", "")),
        ("diTool1X", (1, "x", "")),
        ("TOOL1_X_UM", (1, "x", "um")),
        ("tool[2] offset u", (2, "u", "")),
        ("lrTool12OffsetZ", (12, "z", "")),
        ("stTool[3].lrPosV", (3, "v", "")),
        ("GVL.aTools[3].X", (3, "x", "")),
        ("Nozzle03.U_deg", (3, "u", "deg")),
        ("needle1 y mm", (1, "y", "mm")),
        ("PLC_PRG.fbTool.aOffset[2].rY", (2, "y", "")),
        ("wTool1W", (1, "w", "")),
        ("刀具1_X", (1, "x", "")),
        ("刀具\uff11\uff3f\uff38", (1, "x", "")),
        ("工具2.Y轴偏移(mm)", (2, "y", "mm")),
        ("GVL.吸嘴[3].Z补偿值", (3, "z", "")),
        ("针头3号U角度", (3, "u", "")),
    ],
)
def test_names_that_plc_people_write_are_understood(name, found):
    assert component_of(name) == found


@each_row(
    "name",
    [
        *("OldTool1_X", "oldTool1_X", "cmdTool1X", "Tool1_XY", "Tool1.Speed", "Tool1_X_Act"),
        *("Tool0_X", "Tool16_X", "Tool[1,1].X", "T1.xDone", "Timer1_x", "Table1.X", "Tool1"),
        *("刀具1_X_旧", "旧刀具1_X", "刀具1_X设定", "刀具_X", "刀具1速度"),
        *("ToolX", "x_Tool1", "%MW100", "Tool1_X_mm_deg", "", "1", "T1.x.y"),
    ],
)
def test_a_name_that_does_not_clearly_say_it_is_left_to_a_person(name):
    assert component_of(name) is None


GOOD_AND_BAD = """name,address,type,scale
Tool1_X,100,REAL,
Tool1_Y,nowhere,REAL,
Tool1_Z,104,STRING,
Tool1_U,106,REAL,much
GVL.Tool1_X,108,REAL,
Tool2.X_Offset,110,REAL,0.001
Pump,,BOOL,
"""


def test_good_rows_are_kept_beside_bad_ones_each_named_with_its_line(tmp_path):
    draft = draft_of(tmp_path, GOOD_AND_BAD)
    tools = tomllib.loads(draft.text)["tools"]
    assert tools == [
        {"number": 1, "x": {"address": 100, "type": "REAL"}},
        {"number": 2, "x": {"address": 110, "type": "REAL", "scale": 0.001}},
    ]
    assert draft.found == 2
    assert [line.split(":")[0] for line in draft.bad] == [
        "line 3 (Tool1_Y)",
        "line 4 (Tool1_Z)",
        "line 5 (Tool1_U)",
        "line 6 (GVL.Tool1_X)",
        "line 8 (Pump)",
    ]
    assert "X of tool 1 is in an earlier line already" in draft.bad[3]
    for line in draft.bad:
        assert f"# {line}" in draft.text


def test_a_tool_of_which_no_row_is_good_is_not_in_the_draft(tmp_path):
    draft = draft_of(tmp_path, "name,address,type\nTool1_X,1,REAL\nTool2_X,3,STRING\n")
    assert [tool["number"] for tool in tomllib.loads(draft.text)["tools"]] == [1]


@pytest.mark.parametrize(
    ("addresses", "found"),
    [
        (("40401", "40403"), [("holding", 400), ("holding", 402)]),
        (("400401", "300403"), [("holding", 400), ("input", 402)]),
        (("40401", "403"), [(None, 40401), (None, 403)]),
        (("400", "402"), [(None, 400), (None, 402)]),
    ],
)
def test_addresses_as_manuals_print_them_are_understood_when_all_are_so(tmp_path, addresses, found):
    rows = zip(("Tool1_X", "Tool1_Y"), addresses, strict=True)
    draft = draft_of(tmp_path, "name,address\n" + "".join(f"{n},{a}\n" for n, a in rows))
    (tool,) = tomllib.loads(draft.text)["tools"]
    assert [(tool[axis].get("table"), tool[axis]["address"]) for axis in "xy"] == found
    understood = found[0][0] is not None
    assert bool(draft.notes) is understood
    assert ("40401 is holding register 400" in draft.text) is understood


def test_a_unit_in_the_name_counts_unless_the_list_says_another(tmp_path):
    text = "name,address,unit\nTOOL1_X_UM,1,\nTOOL1_Y_UM,3,mm\n"
    (tool,) = tomllib.loads(draft_of(tmp_path, text).text)["tools"]
    assert (tool["x"]["unit"], tool["y"]["unit"]) == ("um", "mm")


CHINESE = (
    "序号;名称;地址;数据类型;单位\n1;刀具1_X;100;REAL;mm\n2;刀具1_Y;102;REAL;mm\n3;急停;5;BOOL;\n"
)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "gbk"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_chinese_lists_are_read_as_spreadsheets_save_them(tmp_path, encoding, separator):
    path = tmp_path / "list.csv"
    path.write_bytes(CHINESE.replace(";", separator).encode(encoding))
    draft = draft_from_csv(path)
    (tool,) = tomllib.loads(draft.text)["tools"]
    assert tool["x"] == {"address": 100, "type": "REAL", "unit": "mm"}
    assert tool["y"]["address"] == 102
    assert draft.left == ("急停",)


def test_a_list_of_no_known_text_is_refused(tmp_path):
    path = tmp_path / "list.csv"
    path.write_bytes(b"name,address\nTool1_X\xff\xff,1\n")
    with pytest.raises(ConfigError, match="neither UTF-8 nor GBK"):
        draft_from_csv(path)


@pytest.mark.parametrize(
    ("heading", "address", "found"),
    [
        ("address", "0x1F4", 500),
        ("address", "16#1f4", 500),
        ("address", "1F4h", 500),
        ("address (hex)", "1F4", 500),
        ("address (hex)", "100", 256),
        ("地址\uff08十六进制\uff09", "0x1F4", 500),
        ("address", "100", 100),
    ],
)
def test_an_address_may_be_hexadecimal_where_it_is_said(tmp_path, heading, address, found):
    draft = draft_of(tmp_path, f"name,{heading}\nTool1_X,{address}\n")
    (tool,) = tomllib.loads(draft.text)["tools"]
    assert tool["x"]["address"] == found


@pytest.mark.parametrize("address", ["1F4", "0x1FFFF", "F4h", "0x"])
def test_an_address_that_only_may_be_hexadecimal_is_asked_for(tmp_path, address):
    text = f"name,address\nTool1_X,{address}\nTool1_Y,2\n"
    draft = draft_of(tmp_path, text)
    assert draft.bad[0].startswith("line 2 (Tool1_X): it has no place")
