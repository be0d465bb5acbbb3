"""``robolink``: the commands, and how one is run."""

import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Final, NoReturn

import click

from robolink import __version__
from robolink.interrupts import Interrupted, one_ending
from robolink.messages import declared, spoken
from robolink.ways import speaking
from robolink_cli.console.exit_codes import exit_code, report
from robolink_cli.console.help_pages import in_language
from robolink_cli.console.language import speaking_for
from robolink_cli.console.output import hand_over, watched_output
from robolink_cli.console.render import dumps, note, print_document, say
from robolink_cli.console.tolerance import colour_wanted, help_width, tolerate_any_console
from robolink_cli.console.ways import SHELL_WAYS
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.shared import shared_options

if TYPE_CHECKING:
    from robolink_cli.stopping.request import StopRequest
    from robolink_cli.stopping.stop_first import StopOutcome

COMMANDS: Final = {
    "demo": (
        "robolink_cli.commands.simulate.demo:demo",
        declared("A nozzle change on a simulated robot, from clogged to proved."),
    ),
    "sim": ("robolink_cli.commands.simulate.sim:sim", declared("Serve a simulated controller.")),
    "status": (
        "robolink_cli.commands.controller.operate:status",
        declared("What the controller is doing."),
    ),
    "where": (
        "robolink_cli.commands.controller.operate:where",
        declared("Where the robot is, and with which tool."),
    ),
    "stop": ("robolink_cli.commands.controller.operate:stop", declared("Stop every motion.")),
    "release": (
        "robolink_cli.commands.controller.operate:release",
        declared("Let the robot be moved again after a stop."),
    ),
    "reset": (
        "robolink_cli.commands.controller.operate:reset",
        declared("Clear an error of the controller."),
    ),
    "motors": (
        "robolink_cli.commands.controller.operate:motors",
        declared("Switch the motors on or off."),
    ),
    "enable": (
        "robolink_cli.commands.controller.operate:enable",
        declared("Enable the axis group of a PLC."),
    ),
    "disable": (
        "robolink_cli.commands.controller.operate:disable",
        declared("Disable the axis group of a PLC."),
    ),
    "take-ownership": (
        "robolink_cli.commands.controller.take_ownership:take_ownership",
        declared("Take a PLC's mailbox from another client, because a person insists."),
    ),
    "recover": (
        "robolink_cli.commands.record.recover:recover",
        declared("Settle what was begun and not proved finished."),
    ),
    "tool": (
        "robolink_cli.commands.controller.tool:tool",
        declared("Read, write, clear and select tool offsets."),
    ),
    "undo": (
        "robolink_cli.commands.record.undo:undo",
        declared("Put back what tools held before a change."),
    ),
    "journal": (
        "robolink_cli.commands.record.journal:journal",
        declared("What is on record: values, proofs, people. Reads only."),
    ),
    "report": (
        "robolink_cli.commands.record.report:report",
        declared("One page about one tool change, from the journal, to keep or print."),
    ),
    "backup": (
        "robolink_cli.commands.controller.backup:backup",
        declared("Save all tools to a file."),
    ),
    "restore": (
        "robolink_cli.commands.controller.backup:restore",
        declared("Put the tools of a backup back."),
    ),
    "compare": (
        "robolink_cli.commands.controller.backup:compare",
        declared("What differs from a backup; exit code 1 when something does."),
    ),
    "io": (
        "robolink_cli.commands.controller.io:io",
        declared("Read inputs, switch outputs and memory bits."),
    ),
    "var": (
        "robolink_cli.commands.controller.var:var",
        declared("Read and set the project's variables."),
    ),
    "verify-controller": (
        "robolink_cli.commands.controller.verify_controller:verify_controller",
        declared("Find out, reading only, what this controller really does."),
    ),
    "jog": (
        "robolink_cli.commands.controller.jog:jog",
        declared("Move a small step, in Power Low."),
    ),
    "calibrate": (
        "robolink_cli.commands.measure.calibrate:calibrate",
        declared("Measure a tool offset, propose it, write it and prove it."),
    ),
    "recalibrate": (
        "robolink_cli.commands.measure.recalibrate:recalibrate",
        declared("The scripted nozzle change: run a recipe."),
    ),
    "station": (
        "robolink_cli.commands.measure.station:station",
        declared("Pins, beams, surfaces and cameras of a cell: where they are, and how sure."),
    ),
    "solve": (
        "robolink_cli.commands.measure.solve.command:solve",
        declared("Calculate a tool offset from a file, offline."),
    ),
    "poses": (
        "robolink_cli.commands.measure.poses:poses",
        declared("What robolink understands of a file of poses."),
    ),
    "doctor": (
        "robolink_cli.commands.computer.doctor:doctor",
        declared("What could get in the way on this computer."),
    ),
    "ports": ("robolink_cli.commands.computer.ports:ports", declared("List the serial ports.")),
    "scan": (
        "robolink_cli.commands.computer.scan:scan",
        declared("Try which of a few addresses answer."),
    ),
    "config": ("robolink_cli.commands.computer.config:config", declared("Look at the cell files.")),
    "completion": (
        "robolink_cli.commands.computer.completion:completion",
        declared("Make TAB complete commands."),
    ),
    "execute-raw": (
        "robolink_cli.commands.controller.operate:execute_raw",
        declared("Run one SPEL+ statement as typed; for engineers."),
    ),
    "spel": (
        "robolink_cli.commands.companions.spel:spel",
        declared("SPEL+ programs: check them, run them, write the companions."),
    ),
    "serve": (
        "robolink_cli.commands.companions.serve:serve",
        declared("Answer programs that calibrate a tool themselves."),
    ),
    "plc": (
        "robolink_cli.commands.companions.plc:plc",
        declared("The register map and data types of a PLC's mailbox."),
    ),
    "impact": (
        "robolink_cli.commands.measure.impact:impact",
        declared("How far a tool change moves the tip at taught points."),
    ),
}
"""Name, where it is, one-line help; in the order of the help page."""

ALIASES: Final = {"resolve": "robolink_cli.commands.record.recover:resolve"}
"""Names of before, which still work and are listed nowhere."""


@click.group(
    cls=LazyGroup,
    lazy=COMMANDS,
    aliases=ALIASES,
    context_settings={"help_option_names": ["-h", "--help"]},
    help=declared(
        "Measure, write and prove tool offsets on EPSON robots.\n\n"
        "The options stand before or after the command's name."
    ),
)
@click.version_option(__version__, prog_name="robolink", message="%(prog)s %(version)s")
@shared_options
def cli() -> None:
    """Root of the commands."""


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    sys.exit(run(sys.argv[1:], last=True))


def run(arguments: Sequence[str], *, last: bool = False) -> int:
    """Run one command line; return the exit code (the table is in ``_exit``).

    Args:
        arguments: The command line without the program's name.
        last: Whether the process ends then.
    """
    with speaking_for(arguments):
        return _guarded(lambda: _answer(arguments), last=last)


def tell_stop(request: "StopRequest", outcome: "StopOutcome") -> int:
    """Tell how a stop ended that needed no click so far; return the exit code."""
    return _guarded(lambda: _tell_stop(request, outcome), last=False)


def _guarded(speak: Callable[[], int], *, last: bool) -> int:
    with one_ending(last=last), watched_output(), speaking(SHELL_WAYS):
        tolerate_any_console()
        try:
            code = speak()
            sys.stdout.flush()
        except KeyboardInterrupt as late:
            return exit_code(late)
    return code


def _tell_stop(request: "StopRequest", outcome: "StopOutcome") -> int:
    from robolink_cli.stopping.outcome import Telling

    telling, code = Telling(request, outcome), 0
    telling.explain_the_holder()
    if outcome.error is not None:
        code = report(outcome.error, as_json=request.json)
    elif request.json:
        hand_over(dumps("robolink/stop/1", telling.payload()))
    else:
        say(telling.sentence())
    sys.stdout.flush()
    for remark in telling.remarks():
        note(remark)
    return code


_UNREAD: Final = declared("Not yet read by a native technician: tell us what reads wrong.")
"""Under the help page of each translation."""


def _root() -> click.Command:
    """Return the root of the commands, in the language of the process."""
    root, said = in_language(cli), spoken(_UNREAD)
    root.epilog = None if said == _UNREAD else said
    return root


def _answer(arguments: Sequence[str]) -> int:
    if "_ROBOLINK_COMPLETE" in os.environ:
        _root().main(list(arguments), prog_name="robolink")  # answers the shell and exits
    try:
        return _invoke(arguments)
    except click.exceptions.Exit as end:
        return end.exit_code
    except (Exception, KeyboardInterrupt) as error:
        code = exit_code(error)
        # That nobody is left to read how it ended is no other end.
        with suppress(Interrupted):
            # Looked for by hand, because the arguments may be what is wrong.
            report(error, as_json="--json" in arguments)
        return code


def _invoke(arguments: Sequence[str]) -> int:
    colour = colour_wanted()
    width = help_width()
    with _root().make_context(
        "robolink", list(arguments), color=colour, terminal_width=width
    ) as context:
        code = cli.invoke(context)
        print_document(context)
    return code if isinstance(code, int) else 0
