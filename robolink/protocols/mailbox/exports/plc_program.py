"""The sources of the mailbox program, for a profile and a kinematics (docs/plc-program.md)."""

import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Final

from robolink.protocols.mailbox._codes import ExportProfile
from robolink.protocols.mailbox._kinematics import find_kinematics_word

PROGRAM_FILES: Final = (
    "robolink_core.st",
    "RL_Kept.st",
    "RL_Machine.st",
    "robolink_softmotion.st",
    "robolink_program.st",
)
"""The sources, each after those that it uses."""

_SECTION: Final = r"[ ]*(?:\(\*|//) {name}:(?: \*\))?\n(.*?)[ ]*(?:\(\*|//) end {name}(?: \*\))?\n"
_READ_MODES: Final = ("RL_SET_SYMBOL", "RL_ACTIVE_SYMBOL", "RL_LAST_SYMBOL")
_ADDRESS: Final = re.compile(r"AT %([IQ])W(\d+)")


def program_texts(
    profile: ExportProfile = ExportProfile.FULL,
    *,
    base: int = 0,
    kinematics: str = "",
    read_modes: Sequence[str] = (),
) -> Mapping[str, str]:
    """Return the sources by file name.

    Args:
        profile: With ``TOOLS`` nothing that moves is in the text.
        base: The first word of inputs and outputs.
        kinematics: Block name of the axis group's kinematics, such as ``Kin_Scara3_Z``, or of two
            that are coupled, ``Kin_Gantry3+Kin_CAxis``; opcode 30004 sets it again. Without one
            that opcode is refused, 303.
        read_modes: Symbols of SMC_READ_TOOL_MODE for the set tool, that of the active movement
            and that of the movement commanded last. With them the program reads the tool by
            SMC_GroupReadTool; without, since no document names them, it remembers the one that
            it set last.

    Example:
        >>> from robolink.protocols.mailbox import ExportProfile
        >>> from robolink.protocols.mailbox.exports import program_texts
        >>> texts = program_texts(ExportProfile.TOOLS, kinematics="Kin_Scara3_Z")
        >>> "robolink_core.st" in texts
        True
    """
    folder = files(__package__) / "program_sources"
    code = find_kinematics_word(kinematics) or 0
    position, coupled, orientation = kinematics.partition("+")
    keep = {"full": profile is ExportProfile.FULL}
    keep["kinematics"] = keep["full"] and bool(code)
    keep["no kinematics"] = not keep["kinematics"]
    keep["coupled"] = keep["kinematics"] and bool(coupled)
    keep |= {"read tool": bool(read_modes), "from memory": not read_modes}
    texts = {}
    for name in PROGRAM_FILES:
        text = (folder / name).read_text(encoding="ascii")
        for section, kept in keep.items():
            pattern = re.compile(_SECTION.format(name=section), re.DOTALL)
            text = pattern.sub(r"\1" if kept else "", text)
        text = text.replace("RL_KINEMATICS_TYPE", "Kin_Coupled" if coupled else kinematics)
        text = text.replace("RL_POSITION_TYPE", position)
        text = text.replace("RL_ORIENTATION_TYPE", orientation)
        for placeholder, symbol in zip(_READ_MODES, read_modes, strict=False):
            text = text.replace(placeholder, symbol)
        text = text.replace("kinematics : UINT := 0;", f"kinematics : UINT := {code};")
        texts[name] = _ADDRESS.sub(lambda at: f"AT %{at[1]}W{int(at[2]) + base}", text)
    return texts
