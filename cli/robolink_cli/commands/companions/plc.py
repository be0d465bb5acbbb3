"""plc export: what a PLC programmer needs to serve the mailbox."""

from collections.abc import Iterable, Mapping, Sequence
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
    opcua: Annotated[
        bool,
        CliOption(
            help="For OPC UA instead of registers: with the list RL_Symbols, which the PLC's "
            "server shows."
        ),
    ] = False,
    force: Annotated[
        bool,
        CliOption(
            help="Overwrite files that you have changed, and remove those of an export for the "
            "other link."
        ),
    ] = False,
) -> None:
    """Write the program of the mailbox; for registers also their map and CANopen data sheet.

    docs/plc-program.md explains how to use the files. Their licence is 0BSD: you may use them in a
    machine without conditions.
    """
    schema = PlcopenSchema(plcopen)
    if opcua and base:
        raise ConfigError(
            tr("A program for OPC UA has no registers, so --base has no meaning with --opcua."),
            remedy=tr("Give one of the two."),
        )
    chosen = ExportProfile(profile)
    texts = plc_texts(chosen, base, kinematics, read_modes, schema=schema, opcua=opcua)
    others = plc_texts(chosen, base, opcua=not opcua).keys() - texts.keys()
    written, removed = export_texts(folder, texts, sorted(others), replace=force)
    if json_is_on():
        payload = {"files": written, "removed": removed, "profile": profile, "base": base}
        emit_json("robolink/plc-export/1", payload)
    else:
        for path in written:
            say(tr("wrote {path}", path=path))
        for path in removed:
            say(tr("removed {path}", path=path))


def plc_texts(
    profile: ExportProfile,
    base: int,
    kinematics: str = "",
    read_modes: Sequence[str] = (),
    *,
    schema: PlcopenSchema = PlcopenSchema.CODESYS,
    opcua: bool = False,
) -> Mapping[str, str]:
    """Return the files by name.

    Args:
        profile: Which opcodes the program holds.
        base: The first register of both blocks.
        kinematics: Block name of the group's kinematics, or two with a + between them, for opcode
            30004; empty for none.
        read_modes: The three symbols of SMC_READ_TOOL_MODE, or none.
        schema: Under which name space the PLCopen XML stands.
        opcua: Whether clients come over OPC UA.

    Raises:
        ConfigError: There is no such kinematics.
    """
    if kinematics and find_kinematics_word(kinematics) is None:
        raise ConfigError(
            tr("{name} is not a kinematics of the register map.", name=kinematics),
            remedy=tr("See the table of kinematics in companions/codesys/register_map.md."),
        )
    program = program_texts(
        profile, base=base, kinematics=kinematics, read_modes=read_modes, opcua=opcua
    )
    registers = {
        "register_map.csv": register_map_csv(base),
        "register_map.md": register_map_markdown(profile, base),
        "robolink_mailbox.eds": electronic_data_sheet(),
    }
    return {
        **program,
        "robolink_program.xml": plcopen_xml(program, schema),
        "errors.csv": error_table_csv(),
        **({} if opcua else registers),
        "robolink_mailbox_types.st": structured_text_types(profile),
    }


def export_texts(
    folder: Path, texts: Mapping[str, str], others: Iterable[str], *, replace: bool = False
) -> tuple[list[str], list[str]]:
    """Write the files into ``folder``, which is created if it is missing.

    A file that is there already with the same content is fine.

    Args:
        folder: Where to.
        texts: The files by name.
        others: Names that the program of the other link has alone: left in the folder, such a
            file would be taken for a part of this one.
        replace: Whether what differs is overwritten, and what is of the other link removed.

    Returns:
        The files that are there, and those that were removed.

    Raises:
        ConfigError: A file is there that differs or is of the other link, or one cannot be
            written or removed.
    """
    _make(folder)
    left = [path for name in others if (path := folder / name).is_file()]
    if left and not replace:
        raise ConfigError(
            tr(
                "{path} is of another export: with --opcua there are no registers, without it no "
                "symbols.",
                path=left[0],
            ),
            remedy=tr("Export into another folder, or give --force to remove it."),
        )
    files = {folder / name: text.encode() for name, text in texts.items()}
    stale = {path: data for path, data in files.items() if not holds(path, data)}
    for path in stale:
        require_free(path, replace=replace)
    for path, data in stale.items():
        save_named(path, data, replace=replace)
    for path in left:
        _remove(path)
    return list(map(str, files)), list(map(str, left))


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be removed: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("Delete the file yourself: this program does not have it."),
        ) from error


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
