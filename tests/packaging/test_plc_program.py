"""The exported mailbox program: read by third-party tools, in two profiles, text and XML."""

import csv
import io
import re
import struct
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from blark.parse import parse_source_code
from robolink_cli import main
from robolink_cli.commands.companions.plc import plc_texts
from robolink_simulators.softmotion.program.structured_plc import PROGRAM_SOURCES
from robolink_simulators.structured_text import SourceText, StructuredProgram, TextDialect
from robolink_simulators.structured_text.parse import RESERVED_WORDS, is_vendor_word, parse

from robolink.protocols.mailbox import (
    COMMAND,
    DEVICE_WORDS,
    RESPONSE,
    SLOT,
    ErrorClass,
    ExportProfile,
    Kinematics,
)
from robolink.protocols.mailbox.exports import (
    PROGRAM_FILES,
    SYMBOL_LIST,
    PlcopenSchema,
    program_texts,
)

FULL, TOOLS = ExportProfile.FULL, ExportProfile.TOOLS
COUPLED = "Kin_Gantry3+Kin_CAxis"
CORE, ADAPTER = "robolink_core.st", "robolink_softmotion.st"
MODES = ("CURRENT", "ACTIVE", "LAST")
MOVING = re.compile(r"MC_Move|Jog|MC_GroupHalt|MC_GroupStop|\b(2102|2103|30004|30007|30008)\b")
COMMENT = re.compile(r"\(\*.*?\*\)|//[^\n]*", re.DOTALL)
XML = "{http://www.plcopen.org/xml/tc6_0200}"


def every_text():
    """Return each text that is exported, once: many programs share most of theirs."""
    found: dict[tuple[str, str], str] = {}
    for profile in ExportProfile:
        for modes, kinematics in (((), COUPLED), (MODES, "Kin_Scara3_Z"), ((), "")):
            texts = program_texts(profile, kinematics=kinematics, read_modes=modes)
            for name, text in texts.items():
                found.setdefault((name, text), f"{profile}-{kinematics}-{name}")
        for name, text in program_texts(profile, opcua=True).items():
            found.setdefault((name, text), f"{profile}-opcua-{name}")
    return [pytest.param(*text, id=told) for text, told in found.items()]


@pytest.mark.parametrize(("name", "text"), every_text())
def test_every_text_is_complete_and_under_0bsd(name, text):
    assert "SPDX-License-Identifier: 0BSD" in text
    assert text.isascii()
    left = ["full:", "kinematics:", "read tool:", "from memory:", "_SYMBOL", "_TYPE;", "coupled:"]
    left += ["symbols:", "registers:"]
    assert [mark for mark in left if mark in text] == []
    parse(name, text, dict(PROGRAM_SOURCES).get(name, TextDialect.CODESYS))


@pytest.mark.parametrize("profile", list(ExportProfile))
def test_the_core_stays_in_the_common_subset(profile):
    core = SourceText("robolink_core.st", program_texts(profile)["robolink_core.st"])
    assert core.dialect is TextDialect.COMMON
    made = StructuredProgram([core], "RL_SlotTable")
    assert made.value("begun") is False


SHIPPED = Path(__file__).parents[2] / "companions" / "codesys"
LISTS = ("RL_Kept.st", "RL_Machine.st")
GLOBAL = re.compile(r"^(?:TYPE|FUNCTION_BLOCK|PROGRAM)\s+(\w+)", re.MULTILINE)


def plain(text):
    return re.sub(r"\{[^}]*\}", "", COMMENT.sub("", text))


def declared_names(text):
    """Return every name declared in a text: types, blocks, members, variables, codes."""
    text = plain(text)
    names = GLOBAL.findall(text)
    for section in re.findall(r"\bVAR(?:_\w+)?\b(.*?)\bEND_VAR\b", text, re.DOTALL):
        names += re.findall(r"^\s*(\w+)(?:\s+AT\s+%\w+)?\s*:", section, re.MULTILINE)
    for kind in ("STRUCT", "UNION"):
        for inside in re.findall(rf":\s*{kind}\b(.*?)\bEND_{kind}\b", text, re.DOTALL):
            names += re.findall(r"^\s*(\w+)\s*:", inside, re.MULTILINE)
    for inside in re.findall(r"TYPE\s+\w+\s*:\s*\((.*?)\)", text, re.DOTALL):
        names += re.findall(r"(\w+)\s*:=", inside)
    return names


def shipped_texts():
    return {path.name: path.read_text() for path in sorted(SHIPPED.glob("*.st"))}


def test_no_name_of_a_shipped_text_is_reserved_anywhere():
    texts = shipped_texts()
    assert {*PROGRAM_FILES, "robolink_mailbox_types.st"} == texts.keys()
    names = {name: declared_names(text) for name, text in texts.items()}
    assert {"RL_MailboxCore", "beat", "i0", "nowMs"} <= {*names["robolink_core.st"]}
    assert {"BIT_POWERED", "OP_JOG", "client_heartbeat", "words"} <= {
        *names["robolink_mailbox_types.st"]
    }
    assert sum(map(len, names.values())) > 500
    found = [
        f"{file}: {name}"
        for file, named in names.items()
        for name in named
        if name.upper() in RESERVED_WORDS or is_vendor_word(name.upper()) or name.endswith("_")
    ]
    assert found == []


def test_a_reserved_name_in_a_shipped_text_is_found():
    text = shipped_texts()["robolink_core.st"].replace("    beat : WORD;", "    Bit : WORD;")
    assert "Bit" in declared_names(text)
    assert is_vendor_word("BIT")


def test_types_blocks_lists_and_the_program_have_a_name_each():
    names = []
    for file, text in shipped_texts().items():
        if "VAR_GLOBAL" in text:
            names.append(file.partition(".")[0])
        names += GLOBAL.findall(plain(text))
    low = [name.lower() for name in names]
    assert {"rl_kept", "rl_keptmemory", "rl_machine", "rl_prg"} <= {*low}
    assert sorted({name for name in low if low.count(name) > 1}) == []


def test_no_variable_has_the_name_of_a_type_or_a_block():
    texts = shipped_texts().values()
    told = {name.lower() for text in texts for name in GLOBAL.findall(plain(text))}
    told |= {name.partition(".")[0].lower() for name in LISTS}
    for text in texts:
        own = [name.lower() for name in declared_names(text)]
        for name in GLOBAL.findall(plain(text)):
            own.remove(name.lower())
        assert told.isdisjoint(own)


def test_the_tools_profile_moves_nothing():
    for text in program_texts(TOOLS).values():
        assert MOVING.search(COMMENT.sub("", text)) is None
    full = program_texts(FULL)
    assert all(MOVING.search(COMMENT.sub("", full[name])) for name in (CORE, ADAPTER))


def test_the_blocks_are_as_long_as_the_register_map_says():
    core, glue = (program_texts(FULL, base=100)[n] for n in ("robolink_core.st", PROGRAM_FILES[-1]))
    slots = 15 * SLOT.words + DEVICE_WORDS
    assert f"RL_Inbox : ARRAY [0..{COMMAND.words - 1}] OF WORD" in core
    assert f"RL_Outbox : ARRAY [0..{RESPONSE.words - 1}] OF WORD" in core
    assert f"RL_SlotWords : ARRAY [0..{slots - 1}] OF WORD" in core
    for address in ("%IW100", "%QW100", f"%QW{100 + RESPONSE.words}"):
        assert f"AT {address} :" in glue


def test_only_the_adapter_names_the_vendors_blocks():
    for name, text in program_texts(FULL, kinematics="Kin_Scara3_Z").items():
        names = [word for word in ("SMC_Group", "MC_Group", "MC_Move", "MC_Set") if word in text]
        told = "RL_Machine.st", "robolink_softmotion.st"
        assert not names or name in told, (name, names)


def test_two_kinematics_are_coupled_by_the_block_for_that():
    texts = program_texts(FULL, kinematics=COUPLED)
    glue = texts[PROGRAM_FILES[-1]]
    declared = dict(re.findall(r"(\w*[kK]inematics) : (TRAFO\.\w+);", glue))
    assert declared == {
        "positionKinematics": "TRAFO.Kin_Gantry3",
        "orientationKinematics": "TRAFO.Kin_CAxis",
        "kinematics": "TRAFO.Kin_Coupled",
    }
    assert re.findall(r"kinematics\.(\w+) := (\w+);", glue) == [
        ("itfPosKin", "positionKinematics"),
        ("itfOriKin", "orientationKinematics"),
    ]
    assert f"kinematics : UINT := {32 * 256 + 11};" in texts["RL_Machine.st"]
    assert "TRAFO.Kin_Coupled" in texts[ADAPTER]


def test_the_core_knows_every_code_of_a_kinematics():
    core = program_texts(FULL)[CORE]
    rules = re.findall(r"found := (\(\((o[01]) >= 0.*);", core)
    assert [operand for _, operand in rules] == ["o0", "o1"]
    for rule, operand in rules:
        python = rule.replace(" AND ", " and ").replace(" OR ", " or ").replace(" = ", " == ")
        known = {code for code in range(-1, 300) if eval(python, {operand: code})}
        assert known == {code.value for code in Kinematics}


def test_the_errors_have_the_members_and_classes_of_the_program():
    rows = list(csv.DictReader(io.StringIO(plc_texts(FULL, 0)["errors.csv"])))
    core = program_texts(FULL)["robolink_core.st"]
    body = core.partition("TYPE RL_Numbers : STRUCT\n")[2].partition("END_STRUCT")[0]
    members = [line.split()[0] for line in body.splitlines() if ":" in line]
    assert sorted(row["member"] for row in rows) == sorted(members)
    known = {str(code.value) for code in ErrorClass}
    for row in rows:
        for code in row["error_class"].replace("..", ", ").split(", "):
            assert code in known


@pytest.mark.parametrize("profile", list(ExportProfile))
def test_the_xml_holds_every_unit_of_the_texts(profile):
    texts = plc_texts(profile, 0, "Kin_Scara3_Z")
    root = ElementTree.fromstring(texts["robolink_program.xml"].encode())
    pous = {pou.get("name"): pou for pou in root.iter(f"{XML}pou")}
    assert {"RL_MailboxCore", "RL_SlotTable", "RL_SoftMotion", "RL_PRG"} <= pous.keys()
    blocks = sum(texts[name].count("\nEND_FUNCTION_BLOCK") for name in PROGRAM_FILES)
    assert len(pous) == blocks + 1
    types = sum(texts[name].count("\nTYPE ") for name in PROGRAM_FILES)
    assert len(list(root.iter(f"{XML}dataType"))) == types
    core = pous["RL_MailboxCore"]
    kinds = {section: len(core.findall(f"{XML}interface/{XML}{section}/*")) for section in KINDS}
    assert kinds == {"inputVars": 10, "outputVars": 2, "inOutVars": 8}
    (inside,) = core.findall(f"{XML}body")
    body = "".join(inside.itertext())
    assert body.strip() in texts["robolink_core.st"]
    lists = {one.get("name"): one for one in root.iter(f"{XML}globalVars")}
    assert lists["RL_Kept"].get("retain") == "true"
    addresses = [
        v.get("address") for v in pous["RL_PRG"].iter(f"{XML}variable") if v.get("address")
    ]
    assert addresses == ["%IW0", "%QW0", "%QW112"]


KINDS = ("inputVars", "outputVars", "inOutVars")


def test_openplc_finds_every_body_as_a_paragraph():
    """Its first stage, xml2st, looks for the child p of ST and accepts only the name space 0201."""
    for profile in ExportProfile:
        usual, other = (
            plc_texts(profile, 0, "Kin_Scara3_Z", schema=schema) for schema in PlcopenSchema
        )
        assert [name for name in usual if usual[name] != other[name]] == ["robolink_program.xml"]
        xml = other["robolink_program.xml"]
        assert xml.count("tc6_0201") == 1
        assert xml.replace("tc6_0201", "tc6_0200") == usual["robolink_program.xml"]
        root = ElementTree.fromstring(xml)
        space = "{http://www.plcopen.org/xml/tc6_0201}"
        bodies = [pou.find(f"{space}body/{space}ST") for pou in root.iter(f"{space}pou")]
        assert len(bodies) > 5
        for body in bodies:
            assert body is not None
            (paragraph,) = body
            assert paragraph.tag == "{http://www.w3.org/1999/xhtml}p"
            assert paragraph.text
            assert not list(paragraph)


def test_what_is_known_of_the_error_numbers_is_in_the_program():
    rows = list(csv.DictReader(io.StringIO(plc_texts(FULL, 0)["errors.csv"])))
    known = {row["member"]: row["number"] for row in rows if row["number"]}
    text = program_texts(FULL)["RL_Machine.st"]
    assert dict(re.findall(r"(\w+) := (\d+)[,)]", text)) == known
    root = ElementTree.fromstring(plc_texts(FULL, 0)["robolink_program.xml"])
    values = root.iter(f"{XML}structValue")
    told = {v.get("member"): v[0].get("value") for held in values for v in held}
    assert told == known


def test_the_program_looks_at_its_registers_once_a_cycle():
    """A server in another task may write between two readings, after the check."""
    body = plain(program_texts(FULL)["robolink_program.st"]).rpartition("END_VAR")[2]
    assert re.findall(r"\b\w*box := \w+[,;]", body) == [
        "inbox := command,",
        "outbox := response,",
        "outbox := response;",
    ]
    assert re.findall(r"\w+ := (?:in|out)box\b", body) == ["command := inbox"]
    assert body.index("command := inbox") < body.index("core(") < body.index("outbox := response;")


def test_the_name_of_the_axis_group_is_replaced_without_a_pin():
    """Replacing MyAxisGroup everywhere is right, in the texts and in the XML."""
    for profile in ExportProfile:
        texts = plc_texts(profile, 0)
        found = {name: text.count("MyAxisGroup") for name, text in texts.items()}
        assert found.pop("robolink_program.st") == 3  # one in the comment on the first lines
        assert found.pop("robolink_program.xml") == 2
        assert not any(found.values())
        renamed = texts["robolink_program.xml"].replace("MyAxisGroup", "Robot")
        assert renamed.count("AxisGroup := Robot") == 2


PUBLISHED = {
    "command": ("readwrite", "ARRAY [0..63] OF UINT"),
    "heartbeat": ("readwrite", "UINT"),
    "response": ("read", "ARRAY [0..113] OF UINT"),
    "slots": ("read", "ARRAY [0..543] OF UINT"),
}


@pytest.mark.parametrize("profile", list(ExportProfile))
def test_a_program_for_opc_ua_publishes_its_arrays_and_has_no_address(profile):
    texts = plc_texts(profile, 0, opcua=True)
    found = re.findall(r"\{attribute 'symbol' := '(\w+)'\}\s+(\w+) : ([^;]+);", texts[SYMBOL_LIST])
    assert {name: (right, kind) for right, name, kind in found} == PUBLISHED
    root = ElementTree.fromstring(texts["robolink_program.xml"].encode())
    lists = {one.get("name"): one for one in root.iter(f"{XML}globalVars")}
    shown = lists["RL_Symbols"]
    assert [v.get("name") for v in shown.iter(f"{XML}variable")] == list(PUBLISHED)
    (plain_text,) = shown.iter(f"{XML}InterfaceAsPlainText")
    assert "".join(plain_text.itertext()) == texts[SYMBOL_LIST]
    assert [v for v in root.iter(f"{XML}variable") if v.get("address")] == []
    assert not any("%" in COMMENT.sub("", texts[name]) for name in PROGRAM_FILES)
    told = {name for text in texts.values() for name in GLOBAL.findall(plain(text))}
    assert SYMBOL_LIST.partition(".")[0] not in told
    names = declared_names(texts[SYMBOL_LIST])
    assert sorted(names) == sorted(PUBLISHED)
    assert not [n for n in names if n.upper() in RESERVED_WORDS or is_vendor_word(n.upper())]


def test_a_program_for_registers_has_nothing_of_opc_ua():
    for text in plc_texts(FULL, 0).values():
        assert "RL_Symbols" not in text


def test_the_unit_is_told_as_a_real():
    made = StructuredProgram([SourceText(CORE, program_texts(FULL)[CORE])], "RL_LrealToReal")
    for unit_um in (1000.0, 1.0, 25400.0, 25.4, 0.3, 1e6, 123456.789, 1e-30):
        made.put("number", unit_um)
        made.cycle(0)
        words = struct.unpack("<HH", struct.pack("<f", unit_um))
        assert (made.value("low"), made.value("high")) == words


@pytest.mark.parametrize(
    "name", [*LISTS, SYMBOL_LIST, pytest.param(PROGRAM_FILES[-1], marks=pytest.mark.soak)]
)
def test_a_foreign_parser_reads_the_lists(name):
    assert parse_source_code(program_texts(FULL, opcua=True)[name]).exception is None


@pytest.mark.soak
@pytest.mark.timeout(200)
@pytest.mark.parametrize("profile", list(ExportProfile))
@pytest.mark.parametrize("name", PROGRAM_FILES)
def test_a_foreign_parser_reads_every_file(profile, name):
    text = program_texts(profile, kinematics="Kin_Scara3_Z")[name]
    assert parse_source_code(text).exception is None
    broken = text.replace(":=", "=:", 1)
    assert broken == text or parse_source_code(broken).exception is not None


def test_what_cannot_be_exported_is_told(tmp_path, capsys):
    folder = str(tmp_path / "plc")
    refused = ("Kin_Nothing", "Kin_CAxis", "Kin_Scara3_Z+Kin_CAxis", "Kin_Gantry3+Kin_Polar")
    for name in refused:
        assert main.run(["plc", "export", folder, "--kinematics", name]) == 2
        assert name in capsys.readouterr().err
    assert main.run(["plc", "export", folder, "--read-modes", "A.B", "C", "D"]) == 2
    assert not (tmp_path / "plc").exists()
    arguments = ["--profile", "full", "--kinematics", "Kin_Scara3_Z", "--read-modes", *MODES]
    assert main.run(["plc", "export", folder, *arguments]) == 0
    adapter = (tmp_path / "plc" / "robolink_softmotion.st").read_text()
    assert "SMC_READ_TOOL_MODE.CURRENT" in adapter
    assert "kinematics : UINT := 2;" in (tmp_path / "plc" / "RL_Machine.st").read_text()
