"""``robolink``: the commands, and how one is run."""

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from gettext import gettext
from typing import TYPE_CHECKING, Any, Final, NoReturn

import click

from robolink import __version__
from robolink.interrupts import Interrupted, one_ending
from robolink.messages import declared, spoken
from robolink.remedy_words import speaking
from robolink_cli.command_map import RENAMED, SECTIONS, SHORT_NAMES
from robolink_cli.console.closed_window import closing_in_order
from robolink_cli.console.help_pages import in_language
from robolink_cli.console.language import speaking_for
from robolink_cli.console.output import (
    colour_wanted,
    hand_over,
    help_width,
    tolerate_any_console,
    watched_output,
)
from robolink_cli.console.person import Person, may_be_guided, person_here
from robolink_cli.console.render import dumps, json_is_on, note, print_document, say
from robolink_cli.console.shell_words import SHELL_WAYS
from robolink_cli.lazy_group import FrontPage
from robolink_cli.options.shared import TYPED, all_shared

if TYPE_CHECKING:
    from robolink_cli.stopping.request import StopRequest
    from robolink_cli.stopping.stop_first import StopOutcome


@click.group(
    cls=FrontPage,
    sections=SECTIONS,
    lazy={},
    unlisted=SHORT_NAMES,
    renamed=RENAMED,
    invoke_without_command=True,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="robolink", message="%(prog)s %(version)s")
@all_shared
@click.pass_context
def cli(context: click.Context) -> object:
    """Root of the commands."""
    if context.invoked_subcommand is not None:
        return None
    # With a cell and no command, ask what to do.
    if not may_be_guided() or json_is_on():
        context.fail(gettext("Missing command."))  # in click's own words
    guided = cli.get_command(context, "change")
    assert guided is not None  # noqa: S101 - it is in the map
    with guided.make_context("change", [], parent=context) as sub:
        return guided.invoke(sub)


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    sys.exit(run(sys.argv[1:], last=True))


def run(arguments: Sequence[str], *, last: bool = False) -> int:
    """Run one command line; return the exit code (the table is in ``console.exit_codes``).

    Args:
        arguments: The command line without the program's name.
        last: Whether the process ends then.
    """
    with speaking_for(arguments):
        try:
            return _guarded(lambda: _answer(arguments), last=last)
        finally:
            # The next line of the same process may be about other cells, or none.
            if places := sys.modules.get("robolink.journal._places"):
                places.name_journals({}, afresh=True)


def tell_stop(request: "StopRequest", outcome: "StopOutcome") -> int:
    """Report how a stop ended that needed no click so far; return the exit code."""
    return _guarded(lambda: _tell_stop(request, outcome), last=False)


def _guarded(speak: Callable[[], int], *, last: bool) -> int:
    with one_ending(last=last), closing_in_order(), watched_output(), speaking(SHELL_WAYS):
        tolerate_any_console()
        try:
            code = speak()
            sys.stdout.flush()
        except KeyboardInterrupt as late:
            from robolink_cli.console.exit_codes import exit_code

            return exit_code(late)
    return code


def _tell_stop(request: "StopRequest", outcome: "StopOutcome") -> int:
    from robolink_cli.stopping.outcome import Telling

    telling, code = Telling(request, outcome), 0
    telling.explain_the_holder()
    if outcome.error is not None:
        from robolink_cli.console.exit_codes import report

        code = report(outcome.error, as_json=request.json)
    elif request.json:
        hand_over(dumps("robolink/stop/1", telling.payload()))
    else:
        say(telling.sentence())
    sys.stdout.flush()
    for remark in telling.remarks():
        note(remark)
    return code


_UNREAD: Final = declared("Not yet checked by a native technician: please report mistakes.")
"""Note below the help page of each translation."""


def _root() -> click.Command:
    """Return the root of the commands, in the language of the process."""
    root, said = in_language(cli), spoken(_UNREAD)
    root.epilog = None if said == _UNREAD else said
    return root


def _answer(arguments: Sequence[str]) -> int:
    if "_ROBOLINK_COMPLETE" in os.environ:
        _root().main(list(arguments), prog_name="robolink")  # answers the shell and exits
    before, code = _logs().logs_open() if _logs() else 0, None
    try:
        code = _ended(arguments)
        _copy_to_the_plant()
    finally:
        if logs := _logs():
            logs.close_logs(beyond=before, code=code)
    return code


def _copy_to_the_plant() -> None:
    """Copy what the command recorded; however that goes, the command has ended as it has."""
    connections = sys.modules.get("robolink.journal._connections")
    journals = connections.journals_added_to() if connections else ()
    if not journals:
        return
    from robolink_cli.session.plant_outbox import copy_at_the_end

    with suppress(Exception, KeyboardInterrupt):
        copy_at_the_end(journals)


def _logs() -> "Any":  # noqa: ANN401 - a module
    """Return what opens logs; ``None`` if nobody has asked for one."""
    return sys.modules.get("robolink_cli.options.log_file")


def _ended(arguments: Sequence[str]) -> int:
    """Carry a command line out; return its exit code."""
    try:
        return _invoke(arguments)
    except click.exceptions.Exit as end:
        return end.exit_code
    except (Exception, KeyboardInterrupt) as caught:
        from robolink_cli.console.exit_codes import exit_code, report

        error = _explained(caught)
        code = exit_code(error)
        # A missing reader of the result does not change the exit code.
        with suppress(Interrupted):
            # Searched for here, because the arguments themselves may be wrong.
            report(error, as_json="--json" in arguments, typed=arguments)
        return code


def _explained(error: BaseException) -> BaseException:
    """Return the error; name unfit packages if they may be the cause."""
    from robolink_cli.console.exit_codes import BUG, exit_code

    if exit_code(error) != BUG:
        return error
    from robolink.errors import ConfigError
    from robolink_cli.unfit_packages import cannot_run, how_to_fit, unfit_packages

    unfit = unfit_packages()
    if not unfit:
        return error
    told = ConfigError(cannot_run(unfit, error), remedy=how_to_fit())
    told.__cause__ = error
    return told


def _invoke(arguments: Sequence[str]) -> int:
    if not arguments and may_be_guided():
        arguments = ["change"]  # without arguments, ask what to do
    if person_here() is not Person.WIRE:
        return _carried_out(arguments)
    from robolink_cli.wizard.host import whole_command
    from robolink_cli.wizard.state import Header

    # Who began it calls it by its name until the command itself knows better.
    return whole_command(Header("", ""), lambda: _carried_out(arguments))


def _carried_out(arguments: Sequence[str]) -> int:
    colour = colour_wanted()
    width = help_width()
    with _root().make_context(
        "robolink", list(arguments), color=colour, terminal_width=width
    ) as context:
        context.meta[TYPED] = tuple(arguments)
        code = cli.invoke(context)
        print_document(context)
    return code if isinstance(code, int) else 0
