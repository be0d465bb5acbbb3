"""The mailbox program of a PLC: its sources, for a profile and a kinematics (docs/plc-program.md)."""

import re
from collections.abc import Mapping
from importlib.resources import files
from typing import Final

from robolink.protocols.mailbox._codes import ExportProfile
from robolink.protocols.mailbox._kinematics import find_kinematics

PROGRAM_FILES: Final = (
    "robolink_core.st",
    "RL_Kept.st",
    "RL_Machine.st",
    "robolink_softmotion.st",
    "robolink_program.st",
)
"""The sources, each after those that it uses."""

_SECTION: Final = r"[ ]*(?:\(\*|//) {name}:(?: \*\))?\n(.*?)[ ]*(?:\(\*|//) end {name}(?: \*\))?\n"
_ADDRESS: Final = re.compile(r"AT %([IQ])W(\d+)")


def program_texts(
    profile: ExportProfile = ExportProfile.FULL, *, base: int = 0, kinematics: str = ""
) -> Mapping[str, str]:
    """Return the sources by file name.

    Args:
        profile: With ``TOOLS`` nothing that moves is in the text.
        base: The first word of inputs and outputs.
        kinematics: Block name of the axis group's kinematics, such as ``Kin_Scara3_Z``; opcode
            30004 sets it again. Without one, and for a coupled one, that opcode is not served.
    """
    folder = files(__package__) / "program_sources"
    code = find_kinematics(kinematics) or 0
    keep = {"full": profile is ExportProfile.FULL}
    keep["kinematics"] = keep["full"] and bool(code)
    texts = {}
    for name in PROGRAM_FILES:
        text = (folder / name).read_text(encoding="ascii")
        for section, kept in keep.items():
            pattern = re.compile(_SECTION.format(name=section), re.DOTALL)
            text = pattern.sub(r"\1" if kept else "", text)
        text = text.replace("RL_KINEMATICS_TYPE", f"TRAFO.{kinematics}")
        text = text.replace("kinematics : UINT := 0;", f"kinematics : UINT := {code};")
        texts[name] = _ADDRESS.sub(lambda at: f"AT %{at[1]}W{int(at[2]) + base}", text)
    return texts
