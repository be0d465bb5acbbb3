"""Poses that exist already: taught on the pendant, typed, or kept in a file.

With the guard open in Teach, where a person touches a tip to a pin, a PC commands nothing
(docs/reference/rules.md 9). So the poses are taught on the pendant and read afterwards. Nothing
moves here and no tool is selected; therefore nothing is proved by turning about the new tip either.

A robot whose axes are let go (SFREE) is pushed by hand; where it then stands, its joints yield and
the weight of the arm takes up their play. EPSON's instructions for this measurement forbid it, and
no pose shows it afterwards (docs/reference/epson.md 3.2). So a person is asked, once a command.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from robolink.calibration import (
    PERSON_SIGMA_Z_MM,
    CalibrationResult,
    ToolFit,
    better_fit,
    fits_alike,
    flange_of,
    require_near,
    require_stored_scale,
    tilted_flange_pose,
    tool_fits,
)
from robolink.errors import CalibrationError, RobolinkError, UndefinedToolError
from robolink.messages import joined, tr
from robolink.methods.two_pose import TwoTouches
from robolink.model import AnsweredBy, Controller, PointReader, Pose, ToolOffset
from robolink.procedures import MeasurementContext, PoseMethod, require_one_height
from robolink.remedy_words import RemedyWord, remedy_word


def were_held(context: MeasurementContext, *, stated: bool) -> bool:
    """Return whether a person says that all axes were held; the answer is recorded.

    Args:
        context: What asks.
        stated: Whether it was said in advance, by an option or in the recipe.

    Returns:
        ``False`` where nobody said it and nobody is to be asked.

    Raises:
        CalibrationError: ``axes_free``: they were released.

    Example:
        >>> from robolink.methods.given_poses import were_held
        >>> from robolink.calibration_run import Limits
        >>> from robolink.procedures import MeasurementContext
        >>> from robolink.controllers import SimpleController
        >>> with SimpleController() as controller:
        ...     settings = Limits().settings
        ...     context = MeasurementContext(controller, None, start=None, settings=settings)
        ...     were_held(context, stated=True)
        True
    """
    by_recipe = bool(context.controller.outcomes.signature.recipe)
    by = AnsweredBy.RECIPE if by_recipe else AnsweredBy.OPTION
    said = context.ask_once(held_question(), given=by if stated else None)
    if said is False:
        raise CalibrationError(
            "axes_free",
            tr("These poses were taught with released axes (SFREE)."),
            remedy=tr(
                "Nothing was written. Switch the motors on, jog the tip onto the pin, and teach "
                "them again."
            ),
        )
    return said is True


def held_question() -> str:
    """Return the question."""
    return tr("Were all axes held by their motors (not SFREE) when these poses were taught?")


def taught_poses(points: PointReader, numbers: Sequence[int]) -> tuple[Pose, ...]:
    """Read points that a person taught on the pendant.

    Raises:
        CalibrationError: ``undefined_point``.
    """
    found = points.read_all(numbers)
    missing = [f"P{number}" for number, pose in found.items() if pose is None]
    if missing:
        raise CalibrationError(
            "undefined_point",
            tr("Not taught on this controller: {points}.", points=", ".join(missing)),
            remedy=tr("Teach them on the pendant, on the selected robot."),
        )
    return tuple(pose for pose in found.values() if pose is not None)


@dataclass(frozen=True, slots=True)
class PosesFound:
    """What given poses show.

    Attributes:
        result: The offset.
        fits: Which tools the poses may have been taught with, the likeliest first.
        better: A tool that fits the poses much better than the one named, if there is one.
    """

    result: CalibrationResult
    fits: tuple[ToolFit, ...]
    better: ToolFit | None


class PointsSource:
    """Measures from poses that exist already.

    Attributes:
        found: What the poses said, after :meth:`measure`.

    Args:
        poses: Brings the poses, mm and degrees.
        method: How they are solved.
        taught_tool: The tool whose tip they describe, 0 when they are flange poses; ``None`` where
            nobody said it: then they are taken for flange poses, and asked about where another
            tool fits them as well.
        plausible_mm: Largest change that needs no explanation by another tool.
        sentence: Where they come from, for a report.
        in_mm: Whether they are in mm for certain, as the controller's own points are; others are
            doubted where the stored tool, or where the robot is, speaks for metres or inches.
        axes_held: Whether it was stated that all axes were held by their motors when they were
            taught. Otherwise a person is asked once; where nobody is there, a note says so.

    Example:
        >>> from robolink.methods import PointsSource
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.controllers import SimpleController
        >>> taught = [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)]
        >>> source = PointsSource(lambda: taught, sentence="Points 10 and 11.", in_mm=True)
        >>> found = source.find(SimpleController(), 1, stored=ToolOffset(12, -3.5, -20))
        >>> [round(length, 3) for length in found.result.offset.components()[:2]]
        [12.0, -4.0]
    """

    def __init__(
        self,
        poses: Callable[[], Sequence[Pose]],
        method: PoseMethod | None = None,
        *,
        taught_tool: int | None = None,
        plausible_mm: float = 2.0,
        sentence: str = "",
        in_mm: bool = False,
        axes_held: bool = False,
    ) -> None:
        self._poses = poses
        self._method = TwoTouches() if method is None else method
        self._said = taught_tool is not None
        self._taught_tool = taught_tool or 0
        self._plausible_mm = plausible_mm
        self._sentence = sentence
        self._in_mm = in_mm
        self._axes_held = axes_held
        self.found: PosesFound | None = None

    @property
    def sentence(self) -> str:
        """Where the poses come from, for a report."""
        return self._sentence

    def measure(
        self, context: MeasurementContext, tool: int, stored: ToolOffset | None
    ) -> CalibrationResult:
        """Solve the poses; see :class:`~robolink.procedures.TipSource`.

        Raises:
            CalibrationError: The poses give no trustworthy result; its code says why, ``axes_free``
                where they were taught with axes released.
            ConfigError: Too many poses for the method.
            UndefinedToolError: The tool with which they were taught has no definition.
        """
        held = were_held(context, stated=self._axes_held)
        try:
            self.found = self.find(context.controller, tool, stored, axes_held=held)
        except _UnknownTool as unknown:
            self._taught_tool = _asked(context, unknown)
            self._said = True
            self.found = self.find(context.controller, tool, stored, axes_held=held)
        return self.found.result

    def find(
        self,
        controller: Controller,
        tool: int,
        stored: ToolOffset | None,
        *,
        axes_held: bool | None = None,
    ) -> PosesFound:
        """Solve the poses and ask which tool they fit. Moves and writes nothing.

        Nobody saw these touches being made: the result says so (docs/reference/evidence.md 1).
        Nor does a pose show whether it was taught with its axes held (docs/reference/epson.md 3.2).

        Args:
            controller: The controller, connected; its tools are read.
            tool: Number of the tool.
            stored: The offset stored now, ``None`` where the tool is not defined.
            axes_held: Whether somebody said that all axes were held; ``None`` for what was stated.

        Raises:
            CalibrationError: As :meth:`measure`; ``touch_heights_differ``, ``suspect_units`` among
                others; ``taught_tool_unknown`` where nobody said with which tool the poses were
                taken, and two tools fit them alike.

        Example:
            >>> from robolink.methods import PointsSource
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.controllers import SimpleController
            >>> source = PointsSource(lambda: [Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)])
            >>> stored = ToolOffset(12, -3.5, -20)
            >>> source.find(SimpleController(), tool=1, stored=stored).result.notes[-1]
            'touches_not_witnessed'
        """
        found = self._found(controller, tool, stored)
        held = self._axes_held if axes_held is None else axes_held
        open_question = () if held else ("axes_not_confirmed",)
        notes = (*found.result.notes, *open_question, "touches_not_witnessed")
        return replace(found, result=replace(found.result, notes=notes))

    def _found(self, controller: Controller, tool: int, stored: ToolOffset | None) -> PosesFound:
        poses = self._poses()
        if self._taught_tool:
            _require_taught_with(self._taught_tool, poses)
        # A pose that names its tool overrides the usual tool of all poses, the flange.
        named = {self._tool_of(pose) for pose in poses}
        tools = {number: _require_defined(controller, number) for number in sorted(named)}
        if not self._method.upright:
            flange = [tilted_flange_pose(pose, tools[self._tool_of(pose)]) for pose in poses]
            return self._compared(
                controller, tool, self._solved(controller, flange, stored), poses, named
            )
        for number, taught in tools.items():
            _require_upright(number, taught)
        flange = [flange_of(pose, tools[self._tool_of(pose)]) for pose in poses]
        result = self._solved(controller, flange, stored)
        require_one_height([pose.z_mm for pose in flange], sigma_z_mm=PERSON_SIGMA_Z_MM)
        return self._compared(controller, tool, result, poses, named)

    def _compared(
        self,
        controller: Controller,
        tool: int,
        result: CalibrationResult,
        poses: Sequence[Pose],
        named: set[int],
    ) -> PosesFound:
        """Compare the result with those that other tools would give.

        Raises:
            CalibrationError: ``taught_tool_unknown``.
        """
        if named != {self._taught_tool}:
            return PosesFound(result, (), None)
        # The listing may lack V and W; values to compare and write come from single reads.
        listed = {number: o for number, o in controller.tools.read_all().items() if o is not None}
        fits = tool_fits(result, taught=self._taught_tool, stored=listed, calibrated=tool)
        if not self._said and any(pose.tool is None for pose in poses):
            alike = fits_alike(fits, taught=self._taught_tool, plausible_mm=self._plausible_mm)
            if alike:
                raise _UnknownTool(self._taught_tool, alike)
        better = better_fit(fits, taught=self._taught_tool, plausible_mm=self._plausible_mm)
        if better is not None:
            result = replace(result, warnings=(*result.warnings, "other_tool_fits"))
        return PosesFound(result, fits, better)

    def _solved(
        self, controller: Controller, flange: Sequence[Pose], stored: ToolOffset | None
    ) -> CalibrationResult:
        if self._in_mm:
            return self._method.solve(flange, stored)
        live = _live_pose(controller)
        if live is not None and not any(pose.local for pose in (*flange, live)):
            require_near(flange, live)
        result = self._method.solve(flange, stored)
        require_stored_scale(result, stored)
        return result

    def _tool_of(self, pose: Pose) -> int:
        return self._taught_tool if pose.tool is None else pose.tool

    @property
    def remedy(self) -> str:
        """What to do when they make the tip jump."""
        if self.found is not None and self.found.better is not None:
            return tr(
                "The poses fit tool {better} better. Taught with it? Give {taught_tool} {better}.",
                taught_tool=remedy_word(RemedyWord.TAUGHT_TOOL),
                better=self.found.better.tool,
            )
        return tr(
            "Did all poses touch one point, taught with that tool ({taught_tool})?",
            taught_tool=remedy_word(RemedyWord.TAUGHT_TOOL),
        )


class _UnknownTool(CalibrationError):
    """Two tools fit the poses equally well, and nobody said which one was selected."""

    def __init__(self, taught: int, alike: Sequence[ToolFit]) -> None:
        self.tools = (*sorted(fit.tool for fit in alike), taught)
        self.apart_mm = max(fit.apart_mm for fit in alike)
        ways = [f"{remedy_word(RemedyWord.TAUGHT_TOOL)} {tool}" for tool in sorted(self.tools)]
        super().__init__(
            "taught_tool_unknown",
            tr(
                "The poses fit tools {tools} alike, and the values would be {apart:.3f} mm apart: "
                "which tool was selected when they were taken?",
                tools=", ".join(map(str, sorted(self.tools))),
                apart=self.apart_mm,
            ),
            remedy=tr(
                "Nothing was written. State it with {ways}; 0 is the flange.",
                ways=joined(tr(" or "), ways),
            ),
        )


def _asked(context: MeasurementContext, unknown: _UnknownTool) -> int:
    """Ask a person which tool was selected; the answer is recorded.

    Raises:
        CalibrationError: ``taught_tool_unknown``: nobody knows it, or nobody can be asked.
    """
    for tool in unknown.tools:
        question = tr(
            "The poses fit tools {tools} alike, and the values would be {apart:.3f} mm apart. "
            "Was tool {tool} selected when they were taken (0: the flange)?",
            tools=", ".join(map(str, sorted(unknown.tools))),
            apart=unknown.apart_mm,
            tool=tool,
        )
        if context.ask_once(question):
            return tool
    raise unknown


def _live_pose(controller: Controller) -> Pose | None:
    """Return where the robot is; ``None`` if that cannot be read, which refuses nothing."""
    try:
        return controller.groups[0].pose() if controller.groups else None
    except RobolinkError:
        return None


def _require_taught_with(tool: int, poses: Sequence[Pose]) -> None:
    """Refuse poses that state another tool than the one named.

    Raises:
        CalibrationError: ``tool_pose``.
    """
    other = next((pose.tool for pose in poses if pose.tool not in (None, tool)), None)
    if other is not None:
        raise CalibrationError(
            "tool_pose",
            tr(
                "These poses are those of tool {other}, not of tool {tool}.", other=other, tool=tool
            ),
            remedy=tr(
                "Name the tool that was selected with {taught_tool}; its value on "
                "this controller is used.",
                taught_tool=remedy_word(RemedyWord.TAUGHT_TOOL),
            ),
        )


def _require_defined(controller: Controller, tool: int) -> ToolOffset:
    offset = controller.tools.read(tool)
    if offset is None:
        raise UndefinedToolError(
            tr("Tool {tool} is not defined, so no pose was taught with it.", tool=tool),
            remedy=tr(
                "Name the tool that was selected on the pendant with {taught_tool}.",
                taught_tool=remedy_word(RemedyWord.TAUGHT_TOOL),
            ),
            controller=controller.identity,
        )
    return offset


def _require_upright(tool: int, offset: ToolOffset) -> None:
    if offset.v_deg or offset.w_deg:
        raise CalibrationError(
            "tilted_pose",
            tr("Tool {tool} is tilted (V or W is not 0).", tool=tool),
            remedy=tr("Teach the poses with Tool 0."),
        )
