"""spel: programs that run on the controller itself."""

import sys
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError, ControllerFaultError
from robolink.files.durable import sync_folder, write_whole
from robolink.files.named import holds
from robolink.messages import tr
from robolink.model import json_fields
from robolink.timing import NS_PER_S
from robolink_cli.console.exit_codes import USAGE
from robolink_cli.console.numbers import NumberInside
from robolink_cli.console.render import emit_json, json_is_on, note, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.options.simulation import Encoding, ProjectOptions, tell_encoding

if TYPE_CHECKING:
    from robolink_simulators.epson import EpsonSimulator
    from robolink_simulators.epson.spel.programs.program_load import CheckedProject
    from robolink_simulators.epson.spel.tasks.runner import ProgramRunner
    from robolink_simulators.epson.spel.tasks.task import TaskFailure


_EPSON: Final = (
    "epson/robolink_tools.prg",
    "epson/robolink_vision.prg",
    "epson/recal.prg",
    "epson/calc_tool.prg",
    "epson/calc_board_tool.prg",
    "LICENSE",
)


def companion_texts() -> Mapping[str, bytes]:
    """Return the EPSON companions' files by the name they get, with the line ends of RC+'s PC."""
    packaged = files("robolink_cli").joinpath("companions")
    # A source checkout has them at its top level; only a wheel has them in the package.
    folder = packaged if packaged.is_dir() else Path(__file__).parents[4] / "companions"
    texts = {Path(name).name: folder.joinpath(name).read_bytes() for name in _EPSON}
    return {name: text.replace(b"\n", b"\r\n") for name, text in texts.items()}


def export_companions(folder: Path, *, replace: bool = False) -> list[Path]:
    """Write the files into ``folder``, which is created if it is missing.

    A file that is there already with the same content is fine.

    Raises:
        ConfigError: A file is there that differs, or one cannot be written.
    """
    texts = companion_texts()
    if not replace:
        _require_own(folder, texts)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in texts.items():
            write_whole(folder / name, data, mode=0o666)
        sync_folder(folder)
    except OSError as error:
        raise ConfigError(
            tr(
                "{folder} cannot be written: {cause}.",
                folder=folder,
                cause=error.strerror or error,
            ),
            remedy=tr("Name a folder that can be written."),
        ) from error
    return [folder / name for name in texts]


def _require_own(folder: Path, texts: Mapping[str, bytes]) -> None:
    for name, data in texts.items():
        path = folder / name
        if path.exists() and not holds(path, data):
            raise ConfigError(
                tr("{path} exists already and differs; it was not overwritten.", path=path),
                remedy=tr("Name another folder, or give --force."),
            )


LONGEST_RUN_S: Final = 3600.0
DEFAULT_ROBOT: Final = "T6-602S"

_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)

_Files = Annotated[tuple[Path, ...], _FILE, CliArgument(metavar="FILE...")]
_PointFiles = Annotated[
    tuple[Path, ...],
    _FILE,
    CliOption(help="Point file of the project, for its labels too. May be repeated."),
]


@click.command("check", short_help="Build SPEL+ programs and show every error.")
@json_option
def check(*, files: _Files, points: _PointFiles = (), encoding: Encoding = None) -> int:
    """Build SPEL+ programs and show every error with its file, line and column.

    All files together are one project; a .sprj file stands for the files that it lists. robolink
    also reads the names in point files, IOLabels.dat and UserErrors.dat in the same folder.
    Nothing runs, and no controller is needed.
    """
    from robolink_simulators.epson.spel.programs.program_load import check_project
    from robolink_simulators.epson.spel.source_text import ProgramRefused

    checked = check_project(files, points, encoding=encoding)
    if json_is_on():
        emit_json("robolink/spel-check/1", _document(checked))
        return USAGE if checked.faults else 0
    tell_encoding(checked.data.encoding, named=encoding)
    for fault in checked.faults:
        note(str(fault))
    if checked.faults:
        raise ProgramRefused(checked.faults)
    say(tr("{count} functions, no error found.", count=len(checked.functions)))
    if checked.data.missing_points:
        note(
            tr(
                "Missing in the folder of the project file: {names}. Undeclared names were "
                "taken as point labels.",
                names=", ".join(checked.data.missing_points),
            )
        )
    elif not checked.data.known:
        note(
            tr(
                "The folder of the programs holds no point file and no IOLabels.dat: "
                "undeclared names were taken as labels."
            )
        )
    return 0


def _document(checked: "CheckedProject") -> dict[str, object]:
    return {
        "files": [str(path) for path in checked.data.programs],
        "functions": list(checked.functions),
        "labels_known": checked.data.known,
        **json_fields(checked.data, "missing_points", "encoding"),
        "faults": [
            {
                **json_fields(fault.place, "file", "line"),
                "column": fault.column or None,
                **json_fields(fault, "text", "expected"),
            }
            for fault in checked.faults
        ],
    }


@click.command("run", short_help="Run SPEL+ programs on a simulated controller.")
@json_option
def run(
    *,
    files: _Files,
    points: _PointFiles = (),
    function: Annotated[
        str | None,
        CliOption(
            metavar="NAME",
            help="The function to start; it takes no arguments. Default: main, or with "
            "background tasks none.",
        ),
    ] = None,
    project: ProjectOptions,
    trace: Annotated[bool, CliOption(help="Show each statement before it runs.")] = False,
    robot: Annotated[
        str | None,
        CliOption(metavar="MODEL", help=f"Model of the robot.  [default: {DEFAULT_ROBOT}]"),
    ] = None,
    options: Annotated[
        tuple[str, ...],
        CliOption(
            "--option",
            metavar="NAME=VALUE",
            help="A behaviour of the device; a wrong name lists all of them. May be repeated.",
        ),
    ] = (),
    most_s: Annotated[
        float,
        NumberInside(min=0.001, max=1e7),
        CliOption(
            "--for", metavar="SECONDS", help="How long a program may run, in simulated time."
        ),
    ] = LONGEST_RUN_S,
) -> None:
    """Run SPEL+ programs on a simulated controller and show what they print.

    --option background_tasks=NAME,NAME names functions that start as background tasks. They run
    until --for is over, and may start main themselves (StartMain); then nothing else is started.

    Simulated time does not wait, unless a TCP/IP port is open or Input waits for a line, which you
    type here. The programs reach only this computer, and no robot moves.
    """
    from robolink_simulators.epson import EpsonSimulator

    from robolink_cli.commands.simulate.epson import ProjectSurroundings, habits

    simulator = EpsonSimulator(robot or DEFAULT_ROBOT, options=habits(options, None))
    printed = list[str]()
    runner = ProjectSurroundings(
        project.vision, project.lines, project.folder, project.encoding
    ).load(simulator, files, points)
    if function is None and not simulator.options.background_tasks:
        function = "main"
    ended = True
    for name in (function,) if project.before is None else (project.before, function):
        ended = _run(simulator, runner, name, most_s, trace=trace, printed=printed)
        if runner.failure is not None:
            too_far = runner.failure.number == simulator.options.numbers.out_of_reach
            raise _failed(runner.failure, DEFAULT_ROBOT if too_far and robot is None else None)
        if not ended:
            break
    if json_is_on():
        seconds = simulator.now_ns / NS_PER_S
        document = {"printed": "".join(printed), "ended": ended, "simulated_s": seconds}
        emit_json("robolink/spel-run/1", document)
    elif not ended:
        note(tr("It was still running after {seconds:g} s of simulated time.", seconds=most_s))


def _run(
    simulator: "EpsonSimulator",
    runner: "ProgramRunner",
    function: str | None,
    most_s: float,
    *,
    trace: bool,
    printed: list[str],
) -> bool:
    """Run a program to its end; return whether that came in time."""
    from robolink_simulators.epson.spel.tasks.runner import run_to_end

    from robolink_cli.commands.simulate.epson import start_function

    def show(text: str) -> None:
        printed.append(text)
        say(text.rstrip("\r\n"))

    runner.on_print = show
    runner.channels.window.ask = _typed_line
    if trace:
        runner.on_statement = lambda task, file, line, text: note(
            f"{task.now_ns / NS_PER_S:12.6f} {task.task_number:3} {file}:{line}: {text}"
        )
    if function is not None:
        start_function(runner, function, simulator.now_ns)
    try:
        return run_to_end(runner, simulator.advance, simulator.next_change, most_s=most_s)
    finally:
        runner.forget()


def _typed_line() -> str | None:
    """Return what is typed for Input, ``None`` at the end of the input."""
    line = sys.stdin.readline()
    return line.rstrip("\r\n") if line else None


def _failed(failure: "TaskFailure", default_robot: str | None) -> ControllerFaultError:
    """Return how a program ended; with the robot, if a default one may be the cause."""
    remedy = tr("Correct that line, or handle the error with OnErr.")
    if default_robot is not None:
        remedy = tr(
            "The program ran on {robot}. Name its robot with --robot, or correct that line.",
            robot=default_robot,
        )
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
        remedy=remedy,
    )


@click.group()
def spel() -> None:
    """Programs for a controller's project."""


spel.add_command(check)
spel.add_command(run)


@spel.command("export", short_help="Write the companion programs.")
@json_option
def export(
    *,
    folder: Annotated[
        Path, click.Path(file_okay=False, path_type=Path), CliArgument(metavar="DIR")
    ],
    force: Annotated[bool, CliOption(help="Overwrite files that you have changed.")] = False,
) -> None:
    """Write the companion programs: robolink's part of a controller's project.

    robolink_tools.prg publishes the tool table while production runs: add it to the RC+ project
    and call RobolinkPublish; docs/monitor-only.md says where. robolink_vision.prg takes pictures
    for the camera vision-guide (docs/camera-and-board.md). With recal.prg the running program
    calibrates a tool itself (docs/spel-callback.md). calc_tool.prg and
    calc_board_tool.prg set tool 1 by Vision Guide; add them only if you need them. The
    licence is 0BSD: you may use them in a machine without conditions.
    """
    written = [str(path) for path in export_companions(folder, replace=force)]
    if json_is_on():
        emit_json("robolink/spel-export/1", {"files": written})
    else:
        for path in written:
            say(tr("wrote {path}", path=path))
