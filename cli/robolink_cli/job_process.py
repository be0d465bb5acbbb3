"""The entry of a job's process: one command line, shown to whoever is at the other end of a wire.

``python -m robolink_cli.job_process FD ARGUMENT...`` does what ``robolink ARGUMENT...`` does. FD is
an inherited stream socket, on which views go out and presses come in, as lines of JSON. This
process has the controller; whoever started it has none.
"""

import os
import socket
import sys
from collections.abc import Sequence
from typing import NoReturn


def main() -> NoReturn:
    """Carry out the command line of this process and exit with its code."""
    try:
        descriptor = int(sys.argv[1])
        os.set_inheritable(descriptor, False)  # what this process starts is no end of the wire
        wire = socket.socket(fileno=descriptor)
    except (IndexError, ValueError, OSError) as error:
        sys.exit(f"python -m robolink_cli.job_process FD ARGUMENT...: no wire ({error})")
    sys.exit(run(wire, sys.argv[2:], last=True))


def run(wire: socket.socket, arguments: Sequence[str], *, last: bool = False) -> int:
    """Carry out one command line; return the exit code, which is the last line on the wire too.

    Args:
        wire: A connected stream socket, which is closed at the end.
        arguments: The command line without the program's name.
        last: Whether the process ends then.
    """
    from robolink_cli.entry import run as run_line
    from robolink_cli.wizard.faces.link import WireLink
    from robolink_cli.wizard.faces.wire import WireFace
    from robolink_cli.wizard.host import shown_on

    link = WireLink(wire)
    with shown_on(WireFace(link)) as kept:
        code = run_line(arguments, last=last)
    link.send({"t": "left", "code": code, "kept": kept})
    link.close()
    return code


if __name__ == "__main__":
    main()
