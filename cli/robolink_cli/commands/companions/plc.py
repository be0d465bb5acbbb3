"""plc export: what a PLC programmer needs to serve the mailbox."""

from pathlib import Path

import click

from robolink.messages import tr
from robolink_cli.commands.companions.check_map import check_map
from robolink_cli.console.render import emit_json, json_is_on, say
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
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option(
    "--profile",
    type=click.Choice(["tools", "full"]),
    default="tools",
    show_default=True,
    help="tools: tool offsets only, no motion; full: all opcodes.",
)
@click.option(
    "--base",
    type=click.IntRange(0, _LAST_BASE),
    metavar="N",
    default=0,
    show_default=True,
    help="First register of both blocks, counted from 0.",
)
@click.option(
    "--kinematics",
    default="",
    metavar="NAME",
    help="Kinematics of the axis group, such as Kin_Scara3_Z or Kin_Gantry3+Kin_CAxis;"
    " opcode 30004 sets it again.",
)
@click.option(
    "--read-modes",
    nargs=3,
    default=None,
    metavar="SET ACTIVE LAST",
    callback=lambda _, __, given: _symbols(given),
    help="Symbols of SMC_READ_TOOL_MODE in your Library Manager, to read tools by the block.",
)
@click.option(
    "--plcopen",
    type=click.Choice(["0200", "0201"]),
    default="0200",
    show_default=True,
    help="Schema of the PLCopen XML: 0200 as CODESYS writes it, 0201 for OpenPLC and Beremiz.",
)
@click.option("--force", is_flag=True, help="Overwrite files that were changed.")
@json_option
def export(
    folder: Path,
    *,
    profile: str,
    base: int,
    kinematics: str,
    read_modes: tuple[str, ...],
    plcopen: str,
    force: bool,
) -> None:
    """Write the program of the mailbox, its register map and its CANopen data sheet.

    docs/plc-program.md says what to do with them. Their licence is 0BSD: they may be used in a
    machine without any duty.
    """
    from robolink.protocols.mailbox import ExportProfile
    from robolink.protocols.mailbox.exports import PlcopenSchema
    from robolink_cli.commands.companions.plc_export import export_texts, plc_texts

    schema = PlcopenSchema(plcopen)
    texts = plc_texts(ExportProfile(profile), base, kinematics, read_modes, schema=schema)
    written = [str(path) for path in export_texts(folder, texts, replace=force)]
    if json_is_on():
        emit_json("robolink/plc-export/1", {"files": written, "profile": profile, "base": base})
    else:
        for path in written:
            say(tr("wrote {path}", path=path))
