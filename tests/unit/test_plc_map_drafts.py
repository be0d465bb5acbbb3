"""Register lists as PLC programmers keep them: names, addresses, and rows that cannot be used."""

import tomllib

import pytest

from robolink.errors import ConfigError
from robolink.register_maps import draft_from_csv
from robolink.register_maps._drafts import component_of


def draft_of(tmp_path, text):
    path = tmp_path / "list.csv"
    path.write_text(text, encoding="utf-8")
    return draft_from_csv(path)


@pytest.mark.parametrize(
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


@pytest.mark.parametrize(
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
