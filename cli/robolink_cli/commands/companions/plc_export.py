"""The files that a PLC programmer puts beside the mailbox program."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from robolink.errors import ConfigError
from robolink.files.named import holds, require_free, save_named
from robolink.messages import tr
from robolink.protocols.mailbox import ExportProfile, find_kinematics_word
from robolink.protocols.mailbox.exports import (
    PlcopenSchema,
    electronic_data_sheet,
    error_table_csv,
    plcopen_xml,
    program_texts,
    register_map_csv,
    register_map_markdown,
    structured_text_types,
)


def plc_texts(
    profile: ExportProfile,
    base: int,
    kinematics: str = "",
    read_modes: Sequence[str] = (),
    *,
    schema: PlcopenSchema = PlcopenSchema.CODESYS,
) -> Mapping[str, str]:
    """Return the files by name.

    Args:
        profile: Which opcodes the program holds.
        base: The first register of both blocks.
        kinematics: Block name of the group's kinematics, or two with a + between them, for opcode
            30004; empty for none.
        read_modes: The three symbols of SMC_READ_TOOL_MODE, or none.
        schema: Under which name space the PLCopen XML stands.

    Raises:
        ConfigError: There is no such kinematics.
    """
    if kinematics and find_kinematics_word(kinematics) is None:
        raise ConfigError(
            tr("{name} is not a kinematics of the register map.", name=kinematics),
            remedy=tr("See the table of kinematics in register_map.md."),
        )
    program = program_texts(profile, base=base, kinematics=kinematics, read_modes=read_modes)
    return {
        **program,
        "robolink_program.xml": plcopen_xml(program, schema),
        "errors.csv": error_table_csv(),
        "register_map.csv": register_map_csv(base),
        "register_map.md": register_map_markdown(profile, base),
        "robolink_mailbox.eds": electronic_data_sheet(),
        "robolink_mailbox_types.st": structured_text_types(profile),
    }


def export_texts(folder: Path, texts: Mapping[str, str], *, replace: bool = False) -> list[Path]:
    """Write the files into ``folder``, which is made when it is missing.

    A file that is there already with the same content is fine.

    Raises:
        ConfigError: A file is there that differs, or one cannot be written.
    """
    _make(folder)
    files = {folder / name: text.encode() for name, text in texts.items()}
    stale = {path: data for path, data in files.items() if not holds(path, data)}
    for path in stale:
        require_free(path, replace=replace)
    for path, data in stale.items():
        save_named(path, data, replace=replace)
    return list(files)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            tr(
                "{folder} cannot be written: {cause}.",
                folder=folder,
                cause=error.strerror or error,
            ),
            remedy=tr("Name a folder that can be written."),
        ) from error
