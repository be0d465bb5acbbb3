"""The list of files of a project, as RC+ writes it in a .sprj file (docs/reference/spel.md 16)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_simulators.epson.spel.source.point_file import blocks, project_text

PROJECT_SUFFIX: Final = ".sprj"


@dataclass(frozen=True, slots=True)
class ProjectFiles:
    """Files of a project.

    Attributes:
        programs: Its .prg files, in their order.
        points: Its .pts files whose points are there when a program starts.
        further_points: Those that only LoadPoints brings.
        missing_points: Names of those that are listed and not there.
    """

    programs: tuple[Path, ...]
    points: tuple[Path, ...] = ()
    further_points: tuple[Path, ...] = ()
    missing_points: tuple[str, ...] = ()


def project_files(programs: Sequence[Path], points: Sequence[Path] = ()) -> ProjectFiles:
    """Return the files that are named; in place of a .sprj file, those that it lists.

    Raises:
        ConfigError: It cannot be read, lists no program or one that is not there, or is not alone.
            A point file that is not there is told with the result: programs can be looked at
            without it.
    """
    if not any(path.suffix.lower() == PROJECT_SUFFIX for path in programs):
        return ProjectFiles(tuple(programs), tuple(points))
    if len(programs) > 1:
        raise ConfigError(
            tr("A project file lists its own programs: no other file goes with it."),
            remedy=tr("Give the .sprj file, or the .prg files."),
        )
    (project,) = programs
    listed, at_start, later, missing = list[Path](), list[Path](), list[Path](), list[str]()
    for names, pairs in blocks(project_text(project, None)):
        name = pairs.get("sName", "")
        if names == ("ProgramFile",) and name:
            path = _beside(project, name)
            if path is None:
                raise ConfigError(
                    tr("{path} lists {name}, which is not beside it.", path=project, name=name),
                    remedy=tr("Copy the whole project folder."),
                )
            listed.append(path)
        elif names == ("PointFile",) and name:
            default = pairs.get("bDefault") == "True" and pairs.get("nRobot", "1") == "1"
            path = _beside(project, name)
            if path is None:
                missing.append(name)
            else:
                (at_start if default else later).append(path)
    if not listed:
        raise ConfigError(
            tr("{path} lists no program.", path=project),
            remedy=tr("Give a project file that RC+ has saved, or the .prg files."),
        )
    return ProjectFiles(tuple(listed), (*at_start, *points), tuple(later), tuple(missing))


def _beside(project: Path, name: str) -> Path | None:
    """Return a file of the project's folder; RC+ does not tell capitals from small letters."""
    for path in sorted(project.parent.iterdir()):
        if path.name.lower() == name.lower():
            return path
    return None
