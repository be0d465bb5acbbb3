"""The schema of PLCopen, version 2.01, reads the exported XML.

It states no licence, so it is not here: ``TC6_SCHEMA`` names a copy (docs/contributing.md). CODESYS
writes the name space of version 2.0 (docs/reference/structured_text.md 3), so that replaces the
schema's own unless 0201 is exported.
"""

import os
from pathlib import Path

import pytest
from robolink_cli.commands.companions.plc import plc_texts

from robolink.protocols.mailbox import ExportProfile
from robolink.protocols.mailbox.exports import PlcopenSchema

etree = pytest.importorskip("lxml.etree")

SCHEMA = os.environ.get("TC6_SCHEMA", "")

pytestmark = pytest.mark.skipif(
    not SCHEMA, reason="the schema of PLCopen is not given: TC6_SCHEMA=tc6_xml_v201.xsd"
)


def complaints(text, schema=PlcopenSchema.CODESYS):
    """Return the schema's complaints about a file."""
    published = Path(SCHEMA).read_text(encoding="utf-8").replace("tc6_0201", f"tc6_{schema}")
    judge = etree.XMLSchema(etree.fromstring(published.encode()))
    judge.validate(etree.fromstring(text.encode()))
    return [str(error) for error in judge.error_log]


@pytest.mark.parametrize("schema", list(PlcopenSchema))
@pytest.mark.parametrize("kinematics", ["", "Kin_Scara3_Z", "Kin_Gantry3+Kin_CAxis"])
@pytest.mark.parametrize("profile", list(ExportProfile))
def test_the_schema_has_nothing_against_the_export(profile, kinematics, schema):
    text = plc_texts(profile, 0, kinematics, schema=schema)["robolink_program.xml"]
    assert complaints(text, schema) == []


def test_it_has_something_against_a_damaged_one():
    text = plc_texts(ExportProfile.FULL, 0)["robolink_program.xml"]
    damaged = text.replace("<pous>", "<pou>").replace("</pous>", "</pou>")
    assert any("pou" in complaint for complaint in complaints(damaged))
