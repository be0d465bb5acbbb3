"""The start of a process of ``robolink``: a stop goes its own way, all else goes to click.

Nothing is imported here that a stop does not need before its frame (docs/decisions/0017).
"""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from robolink_cli.stopping.request import StopRequest


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    sys.exit(run(sys.argv[1:], last=True))


def run(arguments: Sequence[str], *, last: bool = False) -> int:
    """Run one command line; return the exit code (the table is in ``console.exit_codes``).

    Args:
        arguments: The command line without the program's name.
        last: Whether the process ends then.
    """
    if "stop" in arguments:
        from robolink_cli.stopping.request import read_stop

        request = read_stop(arguments)
        if request is not None:
            return _stop(request, arguments)
    try:
        from robolink_cli.main import run as run_any
    except Exception as error:  # a package of another version can fail in any way
        from robolink_cli.unfit_packages import answer_without_click

        return answer_without_click(arguments, error)
    return run_any(arguments, last=last)


def _stop(request: "StopRequest", arguments: Sequence[str]) -> int:
    from robolink_cli.console.language import speaking_for
    from robolink_cli.stopping.stop_first import stop_first

    with speaking_for(arguments):
        outcome = stop_first(request)
        from robolink_cli.main import tell_stop

        return tell_stop(request, outcome)
