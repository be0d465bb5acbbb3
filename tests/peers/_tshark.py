"""Runs tshark over a capture of a tool write, for the judges of both buses."""

import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

import robolink
from robolink import ToolOffset
from robolink.protocols.mailbox import Command, Opcode
from tests._patience import PATIENCE_S

SLOT = 5
NEW = ToolOffset(1.5, 2.0, -3.0, 10.0)
WRITTEN = (1.5, 2.0, -3.0, 10.0, 0.0, 0.0)
"""The same as a frame of the PLC: about Z both angles turn alike."""

_STRICT = ("-o", "tcp.check_checksum:TRUE", "-o", "ip.check_checksum:TRUE")
_COMPLAINT = "_ws.malformed || tcp.checksum.status == 0 || ip.checksum.status == 0"


def write_a_tool(url: str) -> None:
    """Connect, write one tool and disconnect."""
    with robolink.connect(url) as controller:
        controller.tools.write(SLOT, NEW, expected=controller.tools.read(SLOT))


def require_the_tool_written(commands: Sequence[Command]) -> None:
    """Fail unless these are the commands of :func:`write_a_tool`."""
    opcodes = [command.opcode for command in commands]
    assert opcodes == [Opcode.OWNERSHIP, Opcode.WRITE_TOOL, Opcode.OWNERSHIP]
    assert [command.operands[0] for command in commands] == [1, SLOT, 0]
    assert commands[1].pose == WRITTEN


def dissected(
    capture: Path, fields: Iterable[str], *, where: str, options: Sequence[str] = ()
) -> list[list[str]]:
    """Return fields of the frames that match, a frame a line."""
    wanted = [part for name in fields for part in ("-e", name)]
    lines = _tshark(capture, *options, "-Y", where, "-T", "fields", *wanted)
    return [line.split("\t") for line in lines]


def summaries(capture: Path, *, where: str = "frame", options: Sequence[str] = ()) -> list[str]:
    """Return the lines that tshark prints for the frames that match."""
    return _tshark(capture, *options, "-Y", where)


def complaints(capture: Path, *, options: Sequence[str] = ()) -> list[str]:
    """Return the frames that tshark finds faulty."""
    return summaries(capture, where=_COMPLAINT, options=options)


def _tshark(capture: Path, *arguments: str) -> list[str]:
    command = ["tshark", "-n", "-r", str(capture), *_STRICT, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE_S)
    return done.stdout.splitlines()
