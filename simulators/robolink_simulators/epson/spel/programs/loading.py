"""A project put into a controller: points and labels first, then the programs that name them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.epson.memory.bits import IOLabel
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel.programs.io_label_file import read_io_labels
from robolink_simulators.epson.spel.programs.project import build_project
from robolink_simulators.epson.spel.session import PointFile, Session
from robolink_simulators.epson.spel.source.point_file import read_points
from robolink_simulators.epson.spel.source.source_text import encoding_of
from robolink_simulators.epson.spel.tasks.compiled import CompiledFunction, SpelProject
from robolink_simulators.epson.spel.tasks.task_table import MOST_IN_BACKGROUND

IO_LABELS: Final = "IOLabels.dat"


@dataclass(slots=True)
class ProjectData:
    """What a project says beside its programs.

    Attributes:
        points: Points by their numbers.
        point_labels: Their numbers by their labels.
        io_labels: Labels of inputs, outputs and memory bits.
        files: What each point file holds.
        known: Whether any file said so; if none did, a build cannot tell labels from mistakes.
        encoding: The code page of all its files, ``None`` where no one fits them all.
    """

    points: dict[int, Point] = field(default_factory=dict)
    point_labels: dict[str, int] = field(default_factory=dict)
    io_labels: dict[str, IOLabel] = field(default_factory=dict)
    files: dict[str, PointFile] = field(default_factory=dict)
    known: bool = False
    encoding: str | None = None

    @property
    def labels(self) -> frozenset[str] | None:
        """All labels in lower case, ``None`` where they are not known."""
        if not self.known:
            return None
        return frozenset(name.lower() for name in (*self.point_labels, *self.io_labels))


def project_data(programs: Sequence[Path], points: Sequence[Path] = ()) -> ProjectData:
    """Return points and labels: of the files that are named, and of IOLabels.dat beside a program.

    Raises:
        ConfigError: A file cannot be read.
    """
    folders = sorted({path.parent for path in programs})
    beside = [path for folder in folders for path in sorted(folder.glob("*.inc"))]
    listed = [path for folder in folders if (path := folder / IO_LABELS).is_file()]
    encoding = encoding_of((*programs, *points, *beside, *listed))
    data = ProjectData(known=bool(points or listed), encoding=encoding)
    for path in points:
        read, labels = read_points(path, encoding)
        data.points |= read
        data.point_labels |= labels
        data.files[path.name.lower()] = (read, labels)
    for path in listed:
        data.io_labels |= read_io_labels(path, encoding)
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
    session: Session, programs: Sequence[Path], points: Sequence[Path] = ()
) -> SpelProject:
    """Build a project and put its points, labels and preserved variables into a controller.

    Raises:
        ProgramRefused: It cannot be built; the controller is as it was.
        ConfigError: A file cannot be read, or what is to begin in the background cannot.
    """
    data = project_data(programs, points)
    project = build_project(programs, session.options, labels=data.labels, encoding=data.encoding)
    project.background = _in_the_background(project, session.options.background_tasks)
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


def check_project(
    programs: Sequence[Path], points: Sequence[Path] = (), options: EpsonOptions | None = None
) -> tuple[SpelProject, bool]:
    """Build a project for its faults alone; tell too whether its labels were known.

    Raises:
        ProgramRefused: It cannot be built.
        ConfigError: A file cannot be read.
    """
    data = project_data(programs, points or points_beside(programs))
    return build_project(programs, options, labels=data.labels, encoding=data.encoding), data.known
