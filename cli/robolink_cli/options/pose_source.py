"""The source of poses when nothing moves, and its options."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import click

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink.pose_tables import NOTHING_SAID, ReadingChoices
from robolink_cli.console.numbers import decimal

if TYPE_CHECKING:
    from robolink.model import Controller, Pose


def reading_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--columns``, ``--length`` and ``--euler``, passed on as ``choices``."""

    @wraps(function)
    def with_choices(
        *args: object,
        columns: str | None,
        length: str | None,
        euler: str | None,
        **others: object,
    ) -> object:
        return function(*args, choices=ReadingChoices(columns, length, euler), **others)

    command: Callable[..., Any] = with_choices
    for option in (
        click.option(
            "--euler",
            metavar="NAME",
            help=declared(
                "Rule of its angles: epson, kuka, fanuc, xyzrpw, codesys, rotvec, RzRyRx .."
            ),
        ),
        click.option(
            "--length",
            type=click.Choice(["mm", "cm", "m", "in"]),
            help=declared("Unit of its lengths, if the file does not state it."),
        ),
        click.option(
            "--columns",
            metavar="x,y,z,u",
            help=declared("Names of its columns, if the file does not state them; '-' skips one."),
        ),
    ):
        command = option(command)
    return command


_RANGE: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?", re.ASCII)

_STATED: Final = {3: set[str](), 4: {"z_mm"}, 6: {"z_mm", "v_deg", "w_deg"}}
"""Coordinates besides X, Y and U that a typed pose gives, by its count of numbers."""


@dataclass(frozen=True, slots=True)
class PoseSource:
    """The source given in place of a measurement: exactly one of the three.

    Attributes:
        kind: Which one.
        points: Numbers of taught points.
        typed: Three numbers each, X, Y, U; or four, X, Y, Z, U; or six, X, Y, Z, U, V, W.
        path: A file of poses.
        taught_tool: The tool whose tip the poses describe, 0 when they are flange poses; ``None``
            where nobody said it.
        choices: What the file does not say.
        axes_held: Whether it was stated that all axes were held when they were taught.
    """

    kind: Literal["points", "typed", "file"]
    points: tuple[int, ...] = ()
    typed: tuple[tuple[float, ...], ...] = ()
    path: Path | None = None
    taught_tool: int | None = None
    choices: ReadingChoices = NOTHING_SAID
    axes_held: bool = False

    def payload(self) -> dict[str, object]:
        """Return what the document of a calibration says about it."""
        body: dict[str, object] = {"kind": self.kind, "taught_tool": self.taught_tool or 0}
        if self.kind == "points":
            body["points"] = list(self.points)
        elif self.path is not None:
            body["path"] = str(self.path)
        return body

    @property
    def sentence(self) -> str:
        """Its sentence in a report."""
        if self.kind == "points":
            points = ", ".join(f"P{number}" for number in self.points)
            named = tr("points taught on the pendant, {points}", points=points)
        elif self.path is not None:
            named = tr("poses of the file {path}", path=self.path)
        else:
            named = tr("typed poses")
        return tr("{poses}; taught with tool {tool}", poses=named, tool=self.taught_tool or 0)

    def poses(self, controller: "Controller", needs: Sequence[str] = ()) -> "tuple[Pose, ...]":
        """Return the poses; taught points are read from the controller.

        Args:
            controller: The controller, connected.
            needs: What every pose must state besides X, Y and U.

        Raises:
            CalibrationError: ``undefined_point``, or ``non_finite`` in a file.
            ConfigError: The file cannot be used, or a pose does not state what is needed.
        """
        from robolink.methods import taught_poses
        from robolink.pose_tables import read_poses
        from robolink_cli.access.capabilities import points_of

        if self.kind == "points":
            return taught_poses(points_of(controller), self.points)
        if self.path is not None:
            return read_poses(self.path, self.choices, needs=needs).poses
        return tuple(_typed_as_pose(numbers, needs) for numbers in self.typed)


def pose_source_options(
    *, points: str, typed: str, path: str
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the options for the source of poses, passed on as ``poses``.

    These are ``--points``, ``--pose``, ``--poses``, ``--taught-tool``, ``--axes-held`` and how a
    file is read.

    Args:
        points: What the help says about taught points.
        typed: The same about typed poses.
        path: The same about a file of poses.
    """
    options = (
        click.option("--points", metavar="N,N", help=points),
        click.option("--pose", "typed", metavar="X,Y,..", multiple=True, help=typed),
        click.option(
            "--poses",
            "path",
            type=click.Path(dir_okay=False, path_type=Path),
            metavar="FILE",
            help=path,
        ),
        click.option(
            "--taught-tool",
            type=click.IntRange(0, 15),
            metavar="N",
            help=declared("The tool that was selected when the poses were taught (0, the flange)."),
        ),
        click.option(
            "--axes-held",
            is_flag=True,
            help=declared(
                "All axes were held by their motors, none released (SFREE), when the poses "
                "were taught; without it robolink asks you."
            ),
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
            axes_held: bool,
            choices: ReadingChoices,
            **others: object,
        ) -> object:
            poses = pose_source(
                points=points,
                typed=typed,
                path=path,
                taught_tool=taught_tool,
                choices=choices,
                axes_held=axes_held,
            )
            return function(*args, poses=poses, **others)

        command = reading_options(with_poses)
        for option in reversed(options):
            command = option(command)
        return command

    return add


def taught_points_option(points: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add ``--points`` to a command that takes nothing else, passed on as ``poses``.

    With which tool they were taught is a parameter of the method, ``taught_tool``.

    Args:
        points: What the help says about them.
    """

    def add(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def with_points(
            *args: object,
            points: str,
            taught_tool: int | None,
            axes_held: bool,
            **others: object,
        ) -> object:
            poses = PoseSource(
                "points",
                points=point_numbers(points),
                taught_tool=taught_tool,
                axes_held=axes_held,
            )
            return function(
                *args, poses=poses, taught_tool=taught_tool, axes_held=axes_held, **others
            )

        option = click.option("--points", metavar="N,N", required=True, help=points)
        command: Callable[..., Any] = option(with_points)
        return command

    return add


def pose_source(
    *,
    points: str | None,
    typed: tuple[str, ...],
    path: Path | None,
    taught_tool: int | None,
    choices: ReadingChoices,
    axes_held: bool,
) -> PoseSource | None:
    """Return the source that the options name, ``None`` when the robot is to measure.

    Raises:
        ConfigError: More than one source, or none to which ``--taught-tool``, ``--axes-held`` or
            what is said about a file belongs.
    """
    given = {"--points": points, "--pose": typed, "--poses": path}
    named = [name for name, value in given.items() if value]
    if len(named) > 1:
        raise ConfigError(
            tr("These cannot be combined: {names}.", names=", ".join(named)),
            remedy=tr("Give the poses in only one form."),
        )
    if path is None and choices != NOTHING_SAID:
        raise ConfigError(
            tr("--columns, --length and --euler need a file of poses."),
            remedy=tr("Add --poses."),
        )
    of_all: dict[str, Any] = {"taught_tool": taught_tool, "axes_held": axes_held}
    if points:
        return PoseSource("points", points=point_numbers(points), **of_all)
    if typed:
        poses = tuple(_typed_pose(text) for text in typed)
        return PoseSource("typed", typed=poses, **of_all)
    if path is not None:
        return PoseSource("file", path=path, choices=choices, **of_all)
    if taught_tool is not None or axes_held:
        raise ConfigError(
            tr("--taught-tool and --axes-held need existing poses."),
            remedy=tr("Add --points, --pose or --poses."),
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


def _typed_pose(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(decimal(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise _no_pose(text) from error
    if len(numbers) not in _STATED:
        raise _no_pose(text)
    return numbers


def _typed_as_pose(numbers: tuple[float, ...], needs: Sequence[str]) -> "Pose":
    from robolink.model import Pose

    x_mm, y_mm, z_mm, u_deg, v_deg, w_deg = {
        3: (*numbers[:2], 0.0, *numbers[2:], 0.0, 0.0),
        4: (*numbers, 0.0, 0.0),
        6: numbers,
    }[len(numbers)]
    stated = _STATED[len(numbers)]
    if not set(needs) <= stated:
        form = "X,Y,Z,U,V,W" if "v_deg" in needs else "X,Y,Z,U"
        raise ConfigError(
            tr("A typed pose lacks values that are needed here."),
            remedy=tr("Write {form}, in mm and degrees.", form=form),
        )
    return Pose(x_mm, y_mm, z_mm, u_deg, v_deg, w_deg)


def _no_pose(text: str) -> ConfigError:
    return ConfigError(
        tr("{text!r} is not a pose.", text=text),
        remedy=tr(
            "Write X,Y,U in mm and degrees, for example 287.5,103.25,180; or X,Y,Z,U; or "
            "X,Y,Z,U,V,W."
        ),
    )
