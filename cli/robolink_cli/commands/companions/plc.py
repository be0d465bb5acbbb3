"""plc export: what a PLC programmer needs to serve the mailbox."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

import click

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
from robolink_cli.commands.companions.check_map import check_map
from robolink_cli.console.render import emit_json, json_is_on, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option

_LAST_BASE = 64880  # the response block, fifteen slots and the device block end at register 65535


@click.group()
def plc() -> None:
    """The mailbox of a CODESYS SoftMotion PLC, or the registers of any other."""


plc.add_command(check_map)


def _symbols(given: tuple[str, str, str] | None) -> tuple[str, ...]:
    names = given or ()
    if not all(name.isascii() and name.isidentifier() for name in names):
        raise click.BadParameter(tr("a symbol is one name without a dot"))
    return names


@plc.command("export", short_help="Write the program of the mailbox and its register map.")
@json_option
def export(
    *,
    folder: Annotated[
        Path, click.Path(file_okay=False, path_type=Path), CliArgument(metavar="DIR")
    ],
    profile: Annotated[
        Literal["tools", "full"],
        CliOption(help="tools: tool offsets only, no motion; full: all opcodes."),
    ] = "tools",
    base: Annotated[
        int,
        click.IntRange(0, _LAST_BASE),
        CliOption(help="First register of both blocks, counted from 0."),
    ] = 0,
    kinematics: Annotated[
        str,
        CliOption(
            metavar="NAME",
            help="Kinematics of the axis group, such as Kin_Scara3_Z or Kin_Gantry3+Kin_CAxis;"
            " opcode 30004 sets it again.",
            show_default=False,
        ),
    ] = "",
    read_modes: Annotated[
        tuple[str, ...],
        CliOption(
            nargs=3,
            metavar="SET ACTIVE LAST",
            callback=lambda _, __, given: _symbols(given),
            help="Symbols of SMC_READ_TOOL_MODE in your Library Manager, to read tools by the "
            "block.",
        ),
    ] = (),
    plcopen: Annotated[
        Literal["0200", "0201"],
        CliOption(
            help="Schema of the PLCopen XML: 0200 as CODESYS writes it, 0201 for OpenPLC and "
            "Beremiz."
        ),
    ] = "0200",
    force: Annotated[bool, CliOption(help="Overwrite files that you have changed.")] = False,
) -> None:
    """Write the program of the mailbox, its register map and its CANopen data sheet.

    docs/plc-program.md explains how to use them. Their licence is 0BSD: you may use them in a
    machine without conditions.
    """
    schema = PlcopenSchema(plcopen)
    texts = plc_texts(ExportProfile(profile), base, kinematics, read_modes, schema=schema)
    written = [str(path) for path in export_texts(folder, texts, replace=force)]
    if json_is_on():
        emit_json("robolink/plc-export/1", {"files": written, "profile": profile, "base": base})
    else:
        for path in written:
            say(tr("wrote {path}", path=path))


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
    """Write the files into ``folder``, which is created if it is missing.

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
