"""spel check and spel run: a person's own SPEL+ programs, without a controller."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from robolink.errors import ControllerFaultError
from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit_json, json_is_on, note, say
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import project_options

if TYPE_CHECKING:
    from robolink_simulators.epson import EpsonSimulator
    from robolink_simulators.epson.spel.tasks.task import TaskFailure

LONGEST_RUN_S: Final = 3600.0

_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)


def programs_argument(function: Any) -> Any:  # noqa: ANN401 - a decorator of click
    """Add ``FILE...`` and ``--points``."""
    function = click.option(
        "--points",
        multiple=True,
        type=_FILE,
        metavar="FILE",
        help="Point file of the project, for its labels too. May be repeated.",
    )(function)
    return click.argument("files", metavar="FILE...", nargs=-1, required=True, type=_FILE)(function)


@click.command("check", short_help="Build SPEL+ programs and tell every fault.")
@programs_argument
@json_option
def check(files: tuple[Path, ...], points: tuple[Path, ...]) -> None:
    """Build SPEL+ programs and tell every fault with its file, line and column.

    All files together are one project. Point files and IOLabels.dat that lie beside them are
    read for the names in them. Nothing runs and no controller is asked.
    """
    from robolink_simulators.epson.spel.programs.loading import check_project
    from robolink_simulators.epson.spel.source.faults import ProgramRefused

    try:
        project, labels_known = check_project(files, points)
    except ProgramRefused as refused:
        for fault in refused.faults:
            note(str(fault))
        raise
    names = sorted(function.spelled for function in project.functions.values())
    if json_is_on():
        document = {"files": [str(p) for p in files], "functions": names}
        emit_json("robolink/spel-check/1", {**document, "labels_known": labels_known})
        return
    say(tr("{count} functions, no fault found.", count=len(names)))
    if not labels_known:
        note(
            tr(
                "No point file and no IOLabels.dat lies beside the programs: names that nobody "
                "declares were taken for labels."
            )
        )


@click.command("run", short_help="Run SPEL+ programs on a simulated controller.")
@programs_argument
@click.option(
    "--function",
    metavar="NAME",
    help="The function to start; it takes no arguments. Without it main, or none beside background "
    "tasks.",
)
@project_options
@click.option("--trace", is_flag=True, help="Show each statement before it is carried out.")
@click.option(
    "--robot", metavar="MODEL", default="T6-602S", show_default=True, help="Model of the robot."
)
@click.option(
    "--option",
    "options",
    multiple=True,
    metavar="NAME=VALUE",
    help="A habit of the device; a wrong name lists them all. May be repeated.",
)
@click.option(
    "--for",
    "most_s",
    type=NumberInside(min=0.001, max=1e7),
    default=LONGEST_RUN_S,
    show_default=True,
    metavar="SECONDS",
    help="How long a program may run, in simulated time.",
)
@json_option
def run(
    *,
    files: tuple[Path, ...],
    points: tuple[Path, ...],
    function: str | None,
    vision: Path | None,
    lines: tuple[str, ...],
    folder: Path | None,
    trace: bool,
    robot: str,
    options: tuple[str, ...],
    most_s: float,
) -> None:
    """Run SPEL+ programs on a simulated controller and show what they print.

    --option background_tasks=NAME,NAME names functions that begin as background tasks. They go on
    until --for is over, and may start main themselves (StartMain); nothing else is started then.

    Simulated time does not wait, unless a TCP/IP port is open or Input waits for a line, which is
    taken from here. Nothing but this machine is reached, and no robot moves.
    """
    from robolink_simulators.epson import EpsonSimulator

    from robolink_cli.commands.simulate.kinds.epson import ProjectSurroundings, habits

    simulator = EpsonSimulator(robot, options=habits(options, None))
    printed = list[str]()
    simulator.load(files, points)
    ProjectSurroundings(vision, lines, folder).install(simulator)
    if function is None and not simulator.options.background_tasks:
        function = "main"
    ended = _run(simulator, function, most_s, trace=trace, printed=printed)
    program = simulator.program
    if program is not None and program.failure is not None:
        raise _failed(program.failure)
    if json_is_on():
        seconds = simulator.now_ns / NS_PER_S
        document = {"printed": "".join(printed), "ended": ended, "simulated_s": seconds}
        emit_json("robolink/spel-run/1", document)
    elif not ended:
        note(tr("It still ran after {seconds:g} s of simulated time.", seconds=most_s))


def _run(
    simulator: "EpsonSimulator",
    function: str | None,
    most_s: float,
    *,
    trace: bool,
    printed: list[str],
) -> bool:
    """Run a program to its end; tell whether that came in time."""
    from robolink_simulators.epson.refusals import SpelRefusal
    from robolink_simulators.epson.spel.tasks.driving import run_to_end

    runner = simulator.program
    assert runner is not None  # noqa: S101 - loaded before

    def show(text: str) -> None:
        printed.append(text)
        say(text.rstrip("\r\n"))

    runner.on_print = show
    runner.channels.window.ask = _typed_line
    if trace:
        runner.on_statement = lambda task, file, line, text: note(
            f"{task.now_ns / NS_PER_S:12.6f} {task.task_number:3} {file}:{line}: {text}"
        )
    try:
        if function is not None:
            runner.start(function, simulator.now_ns)
    except SpelRefusal as refusal:
        raise click.UsageError(
            tr("There is no function {name} without arguments.", name=function)
        ) from refusal
    try:
        return run_to_end(runner, simulator.advance, simulator.next_change, most_s=most_s)
    finally:
        runner.forget()


def _typed_line() -> str | None:
    """Return what is typed for Input, ``None`` at the end of what there is."""
    line = sys.stdin.readline()
    return line.rstrip("\r\n") if line else None


def _failed(failure: "TaskFailure") -> ControllerFaultError:
    return ControllerFaultError(
        tr(
            "Error {number} in {function}, {file}:{line}, task {task}: {text}.",
            number=failure.number,
            function=failure.function,
            file=failure.file,
            line=failure.line,
            task=failure.task,
            text=failure.text,
        ),
        code=failure.number,
        remedy=tr("Mend that line, or let OnErr deal with the error."),
    )
