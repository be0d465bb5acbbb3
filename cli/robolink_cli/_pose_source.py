"""Where poses come from when nothing moves, and the options that say so."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import click

from robolink.errors import ConfigError
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.model import Controller, Pose

_RANGE: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?", re.ASCII)


@dataclass(frozen=True, slots=True)
class PoseSource:
    """What was given in place of a measurement: exactly one of the three.

    Attributes:
        kind: Which one.
        points: Numbers of taught points.
        typed: X and Y in mm and U in degrees, each.
        path: A file of poses.
        taught_tool: The tool whose tip the poses describe; 0 when they are flange poses.
    """

    kind: Literal["points", "typed", "file"]
    points: tuple[int, ...] = ()
    typed: tuple[tuple[float, float, float], ...] = ()
    path: Path | None = None
    taught_tool: int = 0

    def payload(self) -> dict[str, object]:
        """Return what the document of a calibration says about it."""
        body: dict[str, object] = {"kind": self.kind, "taught_tool": self.taught_tool}
        if self.kind == "points":
            body["points"] = list(self.points)
        elif self.path is not None:
            body["path"] = str(self.path)
        return body

    @property
    def sentence(self) -> str:
        """What a report says about it."""
        if self.kind == "points":
            points = ", ".join(f"P{number}" for number in self.points)
            named = tr("points taught on the pendant, {points}", points=points)
        elif self.path is not None:
            named = tr("poses of the file {path}", path=self.path)
        else:
            named = tr("typed poses")
        return tr("{poses}; taught with tool {tool}", poses=named, tool=self.taught_tool)

    def poses(self, controller: "Controller") -> "tuple[Pose, ...]":
        """Return the poses; taught points are read from the controller.

        Raises:
            CalibrationError: ``undefined_point``, or ``non_finite`` in a file.
            ConfigError: The file cannot be used.
        """
        from robolink.model import Pose
        from robolink.nozzle_change import taught_poses
        from robolink.pose_files import read_poses
        from robolink_cli._kinds import points_of

        if self.kind == "points":
            return taught_poses(points_of(controller), self.points)
        if self.path is not None:
            return read_poses(self.path)
        return tuple(Pose(x_mm, y_mm, 0.0, u_deg) for x_mm, y_mm, u_deg in self.typed)


def pose_source_options(
    *, points: str, typed: str, path: str
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add ``--points``, ``--pose``, ``--poses`` and ``--taught-tool``, passed on as ``poses``.

    Args:
        points: What the help says about taught points.
        typed: The same about typed poses.
        path: The same about a file of poses.
    """
    options = (
        click.option("--points", metavar="N,N", help=points),
        click.option("--pose", "typed", metavar="X,Y,U", multiple=True, help=typed),
        click.option("--poses", "path", type=click.Path(dir_okay=False, path_type=Path), help=path),
        click.option(
            "--taught-tool",
            type=click.IntRange(0, 15),
            metavar="N",
            help=tr("The tool that was selected when the poses were taught (0, the flange)."),
        ),
    )

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def with_poses(
            *args: object,
            points: str | None,
            typed: tuple[str, ...],
            path: Path | None,
            taught_tool: int | None,
            **others: object,
        ) -> object:
            poses = pose_source(points=points, typed=typed, path=path, taught_tool=taught_tool)
            return function(*args, poses=poses, **others)

        command: Callable[..., Any] = with_poses
        for option in reversed(options):
            command = option(command)
        return command

    return add


def pose_source(
    *, points: str | None, typed: tuple[str, ...], path: Path | None, taught_tool: int | None
) -> PoseSource | None:
    """Return what the options name, ``None`` when the robot is to measure.

    Raises:
        ConfigError: More than one source, or none to which ``--taught-tool`` belongs.
    """
    given = {"--points": points, "--pose": typed, "--poses": path}
    named = [name for name, value in given.items() if value]
    if len(named) > 1:
        raise ConfigError(
            tr("{names} exclude each other.", names=", ".join(named)),
            remedy=tr("Give the poses in one way only."),
        )
    tool = taught_tool or 0
    if points:
        return PoseSource("points", points=point_numbers(points), taught_tool=tool)
    if typed:
        poses = tuple(_typed_pose(text) for text in typed)
        return PoseSource("typed", typed=poses, taught_tool=tool)
    if path is not None:
        return PoseSource("file", path=path, taught_tool=tool)
    if taught_tool is not None:
        raise ConfigError(
            tr("--taught-tool belongs to poses that exist already."),
            remedy=tr("Give them with --points, --pose or --poses."),
        )
    return None


def point_numbers(text: str) -> tuple[int, ...]:
    """Read numbers of taught points, 0 to 999: ``901,902`` or ``1-50,60``; each once.

    Raises:
        ConfigError: It is anything else.
    """
    numbers: dict[int, None] = {}
    for part in text.split(","):
        match = _RANGE.fullmatch(part.strip())
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if first > last:
            raise ConfigError(
                tr("{part!r} is not a point or a range of points.", part=part),
                remedy=tr("Write for example 901,902 or 1-50,60; points are 0 to 999."),
            )
        numbers |= dict.fromkeys(range(first, last + 1))
    return tuple(numbers)


def _typed_pose(text: str) -> tuple[float, float, float]:
    try:
        x_mm, y_mm, u_deg = (float(part) for part in text.split(","))
    except ValueError as error:
        raise ConfigError(
            tr("{text!r} is not a pose.", text=text),
            remedy=tr("Write X,Y,U in mm and degrees, for example 287.5,103.25,180."),
        ) from error
    return x_mm, y_mm, u_deg
