"""Loads a project into a controller: points and labels first, then the programs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.epson.memory.bits import IOLabel
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.file_commands import read_points
from robolink_simulators.epson.spel.programs.project import (
    PROJECT_SUFFIX,
    build_project,
    project_files,
    read_io_labels,
    read_user_errors,
)
from robolink_simulators.epson.spel.session import PointFile, Session, UserError
from robolink_simulators.epson.spel.source_text import ProgramFault, ProgramRefused, encoding_of
from robolink_simulators.epson.spel.tasks.compiled_program import CompiledFunction, SpelProject
from robolink_simulators.epson.spel.tasks.runner import MOST_IN_BACKGROUND

IO_LABELS: Final = "IOLabels.dat"
USER_ERRORS: Final = "UserErrors.dat"


@dataclass(slots=True)
class ProjectData:
    """The content of a project besides its programs.

    Attributes:
        points: Points by their numbers.
        point_labels: Their numbers by their labels.
        io_labels: Labels of inputs, outputs and memory bits.
        user_errors: Errors of the project's own by their labels.
        files: What each point file holds.
        known: Whether any file said so; if none did, a build cannot tell labels from mistakes.
        encoding: The code page of all its files, ``None`` where no one fits them all.
        programs: Its program files.
        missing_points: Names of point files that a .sprj file lists and that are not beside it.
    """

    points: dict[int, Point] = field(default_factory=dict)
    point_labels: dict[str, int] = field(default_factory=dict)
    io_labels: dict[str, IOLabel] = field(default_factory=dict)
    user_errors: dict[str, UserError] = field(default_factory=dict)
    files: dict[str, PointFile] = field(default_factory=dict)
    known: bool = False
    encoding: str | None = None
    programs: tuple[Path, ...] = ()
    missing_points: tuple[str, ...] = ()

    @property
    def labels(self) -> frozenset[str] | None:
        """All labels in lower case, ``None`` where they are not known."""
        if not self.known:
            return None
        names = (*self.point_labels, *self.io_labels, *self.user_errors)
        return frozenset(name.lower() for name in names)


def project_data(
    programs: Sequence[Path], points: Sequence[Path] = (), encoding: str | None = None
) -> ProjectData:
    """Return the content of a project besides its programs.

    Beside a program IOLabels.dat and UserErrors.dat are read.

    Args:
        programs: Its programs, or one .sprj file that lists them.
        points: Point files, beside those that a .sprj file lists.
        encoding: The code page of its files, ``None`` where it is to be found out.

    Raises:
        ConfigError: A file cannot be read.
    """
    files = project_files(programs, points)
    every_point_file = (*files.further_points, *files.points)
    folders = sorted({path.parent for path in files.programs})
    beside = [path for folder in folders for path in sorted(folder.glob("*.inc"))]
    listed = [path for folder in folders if (path := folder / IO_LABELS).is_file()]
    errors = [path for folder in folders if (path := folder / USER_ERRORS).is_file()]
    if encoding is None:
        texts = (*files.programs, *every_point_file, *beside, *listed, *errors)
        encoding = encoding_of(texts)
    known = bool(every_point_file or listed) and not files.missing_points
    data = ProjectData(
        known=known,
        encoding=encoding,
        programs=files.programs,
        missing_points=files.missing_points,
    )
    for path in every_point_file:
        read, labels = read_points(path, encoding)
        if path in files.points:
            data.points |= read
        data.point_labels |= labels
        data.files[path.name.lower()] = (read, labels)
    for path in listed:
        data.io_labels |= read_io_labels(path, encoding)
    for path in errors:
        data.user_errors |= read_user_errors(path, encoding)
    return data


def points_beside(programs: Sequence[Path]) -> list[Path]:
    """Return the point files that lie in the folders of some programs."""
    folders = sorted({path.parent for path in programs})
    return [
        path
        for folder in folders
        for path in sorted(folder.iterdir())
        if path.suffix.lower() == ".pts"
    ]


def load_project(
    session: Session,
    programs: Sequence[Path],
    points: Sequence[Path] = (),
    encoding: str | None = None,
) -> SpelProject:
    """Build a project and load its points, labels and preserved variables into a controller.

    The arguments are those of :func:`project_data`.

    Raises:
        ProgramRefused: It cannot be built; the controller is as it was.
        ConfigError: A file cannot be read, or what is to begin in the background cannot.
    """
    data = project_data(programs, points, encoding)
    project = build_project(
        data.programs, session.options, labels=data.labels, encoding=data.encoding
    )
    project.encoding = data.encoding
    project.background = _in_the_background(project, session.options.background_tasks)
    session.user_errors = data.user_errors
    session.point_files.clear()
    session.point_files.update(data.files)
    session.files.encoding = (data.encoding or "utf-8").removesuffix("-sig")
    machine = session.machine
    for number, point in data.points.items():
        machine.points.store(number, point)
    for label, number in data.point_labels.items():
        machine.points.label(number, label)
    machine.io_labels = data.io_labels
    for name, variable in project.preserved().items():
        session.variables.adopt(name, variable.kind.name, variable.bounds, variable.listed())
    return project


def _in_the_background(project: SpelProject, names: str) -> tuple[CompiledFunction, ...]:
    """Return the functions that are named for the background, with commas between."""
    found = list[CompiledFunction]()
    for name in filter(None, (part.strip() for part in names.split(","))):
        function = project.functions.get(name.lower())
        if function is None or function.parameters:
            raise ConfigError(
                tr("There is no function {name} without arguments.", name=name),
                remedy=tr(
                    "Name functions of the programs in background_tasks, with commas between."
                ),
            )
        found.append(function)
    if len(found) > MOST_IN_BACKGROUND:
        raise ConfigError(
            tr("A controller has {most} background tasks.", most=MOST_IN_BACKGROUND),
            remedy=tr("Name no more functions than that in background_tasks."),
        )
    return tuple(found)


@dataclass(frozen=True, slots=True)
class CheckedProject:
    """A project that was built only to find its errors.

    Attributes:
        data: What it says beside its programs.
        functions: Its functions as they are spelled, in alphabetical order.
        faults: All that is wrong with it.
    """

    data: ProjectData
    functions: tuple[str, ...]
    faults: tuple[ProgramFault, ...]


def check_project(
    programs: Sequence[Path],
    points: Sequence[Path] = (),
    options: EpsonOptions | None = None,
    encoding: str | None = None,
) -> CheckedProject:
    """Build a project only to find its errors; without point files those beside it are read.

    Raises:
        ConfigError: A file cannot be read.
    """
    whole = any(path.suffix.lower() == PROJECT_SUFFIX for path in programs)
    data = project_data(programs, points or (() if whole else points_beside(programs)), encoding)
    try:
        project = build_project(data.programs, options, labels=data.labels, encoding=data.encoding)
    except ProgramRefused as refused:
        return CheckedProject(data, (), refused.faults)
    names = sorted(function.spelled for function in project.functions.values())
    return CheckedProject(data, tuple(names), ())
