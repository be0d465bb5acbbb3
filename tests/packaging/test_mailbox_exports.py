"""The files shipped for a PLC match the schema, and other programs can read them."""

import csv
import io
import json
import re
import struct
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import datatypes
from robolink_cli import main
from robolink_cli.commands.companions.plc import plc_texts

from robolink.protocols.mailbox import (
    COMMAND,
    DEVICE,
    DEVICE_START,
    RESPONSE,
    SLOT,
    ExportProfile,
    Opcode,
)
from robolink.protocols.mailbox.exports import structured_text_types

SHIPPED = Path(__file__).parents[2] / "companions" / "codesys"
AGAIN = "run: robolink expert plc export companions/codesys --profile full --force"
SIZES = {"UINT": 2, "INT": 2, "UDINT": 4, "DINT": 4, "REAL": 4, "LREAL": 8, "BYTE": 1}


@pytest.fixture(scope="module")
def objects():
    return canopen.import_od(str(SHIPPED / "robolink_mailbox.eds"), node_id=5)


@pytest.mark.parametrize("name", plc_texts(ExportProfile.FULL, 0))
def test_no_shipped_file_is_stale(name):
    assert (SHIPPED / name).read_text() == plc_texts(ExportProfile.FULL, 0)[name], AGAIN


def test_the_register_map_counts_from_the_base():
    rows = list(
        csv.DictReader(io.StringIO(plc_texts(ExportProfile.TOOLS, 100)["register_map.csv"]))
    )
    found = {(row["block"], row["name"]): row for row in rows}
    assert found["command", "seq_head"]["address"] == "100"
    assert found["command", "seq_head"]["reference"] == "40101"
    assert found["response", "probe"]["reference"] == "30185"
    assert found["slot 15", "counter_tail"]["address"] == str(100 + 112 + 15 * 36 - 1)
    assert found["device", "device_id"]["address"] == str(100 + 652)
    blocks = len(COMMAND.fields) + len(RESPONSE.fields) + 15 * len(SLOT.fields) + len(DEVICE.fields)
    assert len(rows) == blocks


def test_the_registers_of_a_bank_follow_each_other():
    rows = list(csv.DictReader(io.StringIO(plc_texts(ExportProfile.TOOLS, 0)["register_map.csv"])))
    for kind in "43":
        bank = [row for row in rows if row["reference"].startswith(kind)]
        free = 0
        for row in bank:
            assert int(row["address"]) == free
            free += int(row["words"])
        assert free == {"4": 64, "3": 656}[kind]


def test_the_page_of_the_tools_profile_names_no_motion():
    page = plc_texts(ExportProfile.TOOLS, 0)["register_map.md"]
    assert "WRITE_TOOL" in page
    assert "MOVE_LINEAR" not in page


def test_the_data_sheet_holds_the_blocks(objects):
    for index, access in ((0x2100, "rw"), (0x2101, "ro")):
        assert (objects[index].data_type, objects[index].access_type) == (datatypes.DOMAIN, access)
    assert [objects[0x2200][n].data_type for n in range(1, 16)] == [datatypes.DOMAIN] * 15
    assert (objects[0x1018][4].name, objects[0x1018][4].data_type) == (
        "serial number",
        datatypes.UNSIGNED32,
    )
    names = [objects[0x2102][n].name for n in range(1, 6)]
    assert names == ["version", "boot_id", "capabilities", "probe", "snapshot"]
    assert (objects[0x2102][4].default, objects[0x2102][5].access_type) == (12.3456, "rw")


def test_the_data_sheet_holds_the_command_field_by_field(objects):
    fields = [objects[0x2110][n] for n in range(1, len(objects[0x2110]))]
    assert (fields[0].name, fields[-2].name) == ("seq_head", "client_heartbeat")
    named = [field for field in fields if field.data_type != datatypes.VISIBLE_STRING]
    assert len(fields) - len(named) == 1
    assert sum(len(field) for field in named) // 8 + 16 == 128


def test_the_process_data_are_what_the_design_says(objects):
    tpdo, rpdo = objects[0x1A00], objects[0x1600]
    carried = [objects[tpdo[n].default >> 16][tpdo[n].default >> 8 & 0xFF] for n in range(1, 6)]
    assert [entry.name for entry in carried] == [
        "ack",
        "state",
        "group_state",
        "error_class",
        "heartbeat",
    ]
    assert sum(tpdo[n].default & 0xFF for n in range(1, 6)) == 64
    beat = objects[rpdo[1].default >> 16][rpdo[1].default >> 8 & 0xFF]
    assert (beat.name, rpdo[1].default & 0xFF) == ("client_heartbeat", 16)
    assert (objects[0x1800][1].default, objects[0x1400][1].default) == (0x185, 0x205)


def test_a_canopen_node_can_be_made_of_the_data_sheet(objects):
    node = canopen.LocalNode(5, objects)
    canopen.Network().add_node(node)
    node.tpdo.read()
    mapped = node.tpdo[1]
    mapped["head.group_state"].raw = 2
    assert bytes(mapped.data) == struct.pack("<HBBHH", 0, 0, 2, 0, 0)
    assert node.sdo.upload(0x1017, 0) == struct.pack("<H", 100)
    assert 0x1016 in objects


def members(name):
    (body,) = re.findall(
        rf"TYPE {name} : STRUCT.*?\n(.*?)END_STRUCT", structured_text_types(), re.S
    )
    return re.findall(r"    (\w+) : (?:ARRAY\[0\.\.(\d+)\] OF )?(\w+);", body)


@pytest.mark.parametrize(
    ("name", "layout"), [("RL_Command", COMMAND), ("RL_Response", RESPONSE), ("RL_Slot", SLOT)]
)
def test_the_structures_have_the_size_and_order_of_the_blocks(name, layout):
    found = members(name)
    assert [member for member, _, _ in found] == [field.name for field in layout.fields]
    assert sum(SIZES[kind] * (int(last or 0) + 1) for _, last, kind in found) == 2 * layout.words


def test_the_types_of_the_tools_profile_name_no_motion():
    tools, full = (
        structured_text_types(ExportProfile.TOOLS),
        structured_text_types(ExportProfile.FULL),
    )
    assert "OP_MOVE_LINEAR" not in tools
    assert all(f"OP_{code.name} := {code.value}" in full for code in Opcode)
    assert "CAPABILITIES : UINT := 1;" in tools
    assert "CAPABILITIES : UINT := 63;" in full


def test_what_is_compiled_into_a_machine_is_plain_ascii_under_0bsd():
    for name in ("robolink_mailbox_types.st", "robolink_mailbox.eds"):
        text = plc_texts(ExportProfile.FULL, 0)[name]
        assert text.isascii()
        assert "SPDX-License-Identifier: 0BSD" in text


def test_the_export_writes_all_files_and_keeps_changed_ones(tmp_path, capsys):
    folder = tmp_path / "plc"
    assert main.run(["plc", "export", str(folder), "--base", "100"]) == 0
    assert {path.name for path in folder.iterdir()} == set(plc_texts(ExportProfile.TOOLS, 100))
    assert main.run(["plc", "export", str(folder), "--base", "100"]) == 0
    changed = folder / "robolink_mailbox_types.st"
    changed.write_text("// mine")
    assert main.run(["plc", "export", str(folder), "--base", "100"]) == 2
    assert "--force" in capsys.readouterr().err
    assert changed.read_text() == "// mine"
    assert main.run(["plc", "export", str(folder), "--base", "100", "--force"]) == 0
    assert "OP_WRITE_TOOL" in changed.read_text()


def test_a_folder_holds_the_files_of_one_link(tmp_path, capsys):
    of_registers = set(plc_texts(ExportProfile.TOOLS, 0))
    of_symbols = set(plc_texts(ExportProfile.TOOLS, 0, opcua=True))
    assert of_symbols - of_registers == {"RL_Symbols.st"}
    assert of_registers - of_symbols == {
        "register_map.csv",
        "register_map.md",
        "robolink_mailbox.eds",
    }
    notes = tmp_path / "ours.txt"
    notes.write_text("kept")
    command = ["plc", "export", str(tmp_path)]
    for link, files in (["--opcua"], of_symbols), ([], of_registers), (["--opcua"], of_symbols):
        for stale in {path.name for path in tmp_path.iterdir()} - files - {notes.name}:
            assert main.run([*command, *link]) == 2
            told = capsys.readouterr().err
            assert "another export" in told
            assert "--force" in told
            assert (tmp_path / stale).exists()
        assert main.run([*command, *link, "--force"]) == 0
        assert {path.name for path in tmp_path.iterdir()} == files | {notes.name}
    assert f"removed {tmp_path / 'register_map.md'}" in capsys.readouterr().out
    assert main.run([*command, "--opcua"]) == 0


def test_a_file_of_the_other_link_that_cannot_be_removed_is_told(tmp_path, capsys, monkeypatch):
    assert main.run(["plc", "export", str(tmp_path), "--opcua"]) == 0

    def refused(path, **_options):
        raise PermissionError(13, "not yours", str(path))

    monkeypatch.setattr(Path, "unlink", refused)
    assert main.run(["plc", "export", str(tmp_path), "--force"]) == 2
    assert "RL_Symbols.st cannot be removed: not yours" in " ".join(capsys.readouterr().err.split())


def test_the_export_as_a_document(tmp_path, capsys):
    assert main.run(["plc", "export", str(tmp_path), "--profile", "full", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["schema"], document["profile"]) == ("robolink/plc-export/1", "full")
    assert len(document["files"]) == len(plc_texts(ExportProfile.FULL, 0))


def test_a_folder_that_cannot_be_made_is_told(tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert main.run(["plc", "export", str(tmp_path / "file" / "plc")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_a_base_that_leaves_no_room_is_told(tmp_path, capsys):
    last = 0x10000 - DEVICE_START - DEVICE.words
    assert main.run(["plc", "export", str(tmp_path / "plc"), "--base", str(last + 1)]) == 2
    assert str(last) in capsys.readouterr().err
    assert main.run(["plc", "export", str(tmp_path / "plc"), "--base", str(last)]) == 0
