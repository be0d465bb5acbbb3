"""Restores the tools of a backup, one compare-and-set each."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from robolink.backup._comparison import TOOLS, Backup, ToolState, compare
from robolink.errors import (
    ConfigError,
    ReservedToolError,
    RobolinkError,
    ToolError,
    ToolIndexError,
    UndefinedToolError,
)
from robolink.messages import tr
from robolink.model import ControllerFacts, ToolOffset, ToolReceipt, ToolTable
from robolink.remedy_words import RemedyWord, remedy_word


@dataclass(frozen=True, slots=True)
class RestoreChange:
    """One tool whose value in the backup differs.

    Attributes:
        tool: Its number.
        now: What the controller holds; what the write will expect.
        wanted: What the backup holds, ``None`` to clear the tool.
    """

    tool: int
    now: ToolOffset | None
    wanted: ToolOffset | None


@dataclass(frozen=True, slots=True)
class RestorePlan:
    """What a restore will do, in this order: write, select, clear.

    A tool is selected after it was written and before the one it replaces may be cleared.

    Attributes:
        changes: Writes first, then clears.
        select: The tool to select, ``None`` to leave that as it is.
    """

    changes: tuple[RestoreChange, ...]
    select: int | None = None

    @property
    def writes(self) -> tuple[RestoreChange, ...]:
        """The tools that are written."""
        return tuple(change for change in self.changes if change.wanted is not None)

    @property
    def clears(self) -> tuple[RestoreChange, ...]:
        """The tools that are cleared."""
        return tuple(change for change in self.changes if change.wanted is None)

    @property
    def empty(self) -> bool:
        """Whether there is nothing to do."""
        return not self.changes and self.select is None


def require_same_controller(backup: Backup, identity: str, facts: ControllerFacts) -> None:
    """Refuse a controller other than the one that the backup came from.

    Serial numbers decide where both sides know one; where they do not, the URL does.

    Args:
        backup: What is to be restored.
        identity: Of the controller at hand.
        facts: What it says of itself.

    Raises:
        ConfigError: It is another one, or that cannot be told.

    Example:
        >>> import robolink
        >>> from robolink.backup import require_same_controller, take_backup
        >>> with robolink.connect("epson+sim://same-example") as controller:
        ...     kept = take_backup(controller)
        ...     require_same_controller(kept, controller.identity, controller.facts())
    """
    saved = backup.facts
    pairs = (
        (tr("controller serial"), saved.controller_serial, facts.controller_serial),
        (tr("robot serials"), _listed(saved.robot_serials), _listed(facts.robot_serials)),
        (tr("selected robot"), saved.robot_number, facts.robot_number),
    )
    known = [(name, a, b) for name, a, b in pairs if a is not None and b is not None]
    for name, a, b in known:
        if a != b:
            raise _another(
                tr("{name}: {saved} in the backup, {found} here", name=name, saved=a, found=b)
            )
    told_apart = (saved.robot_serials and facts.robot_serials) or (
        saved.controller_serial and facts.controller_serial
    )
    if not told_apart and backup.controller != identity:
        raise _another(
            tr(
                "no serial number can be read, and the backup is from {saved}",
                saved=backup.controller,
            )
        )


def plan_restore(
    backup: Backup, now: ToolState, *, tools: Collection[int] = (), selected: bool = False
) -> RestorePlan:
    """Return the steps that make the controller match the backup.

    Args:
        backup: What is wanted.
        now: What the controller holds.
        tools: Which tools; none for all.
        selected: Whether the selected tool is restored too.

    Raises:
        ToolIndexError, ReservedToolError: No such tool to restore.
        ToolError: The selected tool would lose its definition.
        UndefinedToolError: The tool to select would have none.

    Example:
        >>> import robolink
        >>> from robolink.backup import plan_restore, read_tools, take_backup
        >>> with robolink.connect("epson+sim://plan-example") as controller:
        ...     kept = take_backup(controller)
        ...     new = robolink.ToolOffset(5, 6, -70)
        ...     receipt = controller.tools.write(2, new, expected=None)
        ...     plan = plan_restore(kept, read_tools(controller))
        >>> [change.tool for change in plan.clears]
        [2]
    """
    wanted = sorted(set(tools)) or list(TOOLS)
    for tool in wanted:
        _check_index(tool)
    differing = (tool for tool in compare(backup.state, now).differing if tool.tool in wanted)
    changes = [RestoreChange(tool.tool, tool.found, tool.expected) for tool in differing]
    changes.sort(key=lambda change: (change.wanted is None, change.tool))
    select = backup.state.selected if selected and backup.state.selected != now.selected else None
    plan = RestorePlan(tuple(changes), select)
    _check_selection(plan, now)
    return plan


def restore(
    tools: ToolTable, plan: RestorePlan, *, tell: Callable[[str], None] = lambda _: None
) -> tuple[ToolReceipt, ...]:
    """Carry out ``plan``; each tool only if it still has the value that the plan read.

    Args:
        tools: The table.
        plan: From :func:`plan_restore`.
        tell: Given a sentence for each step that is done.

    Raises:
        RobolinkError: A step failed. Its remedy says which tools are restored and which not.

    Example:
        >>> import robolink
        >>> from robolink.backup import plan_restore, read_tools, restore, take_backup
        >>> with robolink.connect("epson+sim://restore-example") as controller:
        ...     kept = take_backup(controller)
        ...     new = robolink.ToolOffset(5, 6, -70)
        ...     receipt = controller.tools.write(2, new, expected=None)
        ...     receipts = restore(controller.tools, plan_restore(kept, read_tools(controller)))
        ...     print(controller.tools.read(2))
        None
    """
    receipts: list[ToolReceipt] = []
    try:
        for change in plan.writes:
            receipts.append(_set(tools, change, tell))
        if plan.select is not None:
            tools.select(plan.select)
            tell(tr("tool {tool}: selected", tool=plan.select))
        for change in plan.clears:
            receipts.append(_set(tools, change, tell))
    except RobolinkError as error:
        error.say_what_stands(_where_it_ended(plan, receipts))
        raise
    return tuple(receipts)


def _set(tools: ToolTable, change: RestoreChange, tell: Callable[[str], None]) -> ToolReceipt:
    if change.wanted is None:
        receipt = tools.clear(change.tool, expected=change.now)
        tell(tr("tool {tool}: cleared, read back", tool=change.tool))
    else:
        receipt = tools.write(change.tool, change.wanted, expected=change.now)
        tell(tr("tool {tool}: written, read back", tool=change.tool))
    return receipt


def _where_it_ended(plan: RestorePlan, receipts: Sequence[ToolReceipt]) -> str:
    done = [receipt.tool for receipt in receipts]
    left = [change.tool for change in plan.changes if change.tool not in done]
    return tr(
        "Restored before that: {done}. Not restored: {left}.",
        done=_numbers(done),
        left=_numbers(left),
    )


def _check_index(tool: int) -> None:
    if tool == 0:
        raise ReservedToolError(
            tr("Tool 0 is the flange itself and is never written."),
            remedy=tr("Choose a tool from {lowest} to {highest}.", lowest=1, highest=TOOLS[-1]),
        )
    if tool not in TOOLS:
        raise ToolIndexError(
            tr("There is no tool {tool}.", tool=tool),
            remedy=tr("There are tools {lowest} to {highest}.", lowest=1, highest=TOOLS[-1]),
        )


def _check_selection(plan: RestorePlan, now: ToolState) -> None:
    after = {**now.tools, **{change.tool: change.wanted for change in plan.changes}}
    if plan.select and after[plan.select] is None:
        raise UndefinedToolError(
            tr(
                "The backup selects tool {tool}, but that tool would be undefined.",
                tool=plan.select,
            ),
            remedy=tr(
                "Restore that tool too, or leave {selected} out.",
                selected=remedy_word(RemedyWord.SELECTED_TOO),
            ),
        )
    in_force = now.selected if plan.select is None else plan.select
    if any(change.tool == in_force for change in plan.clears):
        raise ToolError(
            tr(
                "Tool {tool} is selected, and the backup has no definition for it.",
                tool=in_force,
            ),
            remedy=tr(
                "Nothing was written. Select another tool first, add {selected}, or "
                "name the other tools with {tools}.",
                selected=remedy_word(RemedyWord.SELECTED_TOO),
                tools=remedy_word(RemedyWord.TOOLS),
            ),
        )


def _another(cause: str) -> ConfigError:
    return ConfigError(
        tr("This backup does not match this controller: {cause}.", cause=cause),
        remedy=tr(
            "Check that this is the right controller and the right file. If the backup is "
            "meant for this controller anyway, {other}.",
            other=remedy_word(RemedyWord.OTHER_CONTROLLER),
        ),
    )


def _listed(texts: Sequence[str]) -> str | None:
    return ", ".join(texts) or None


def _numbers(tools: Sequence[int]) -> str:
    return ", ".join(map(str, tools)) or tr("none")
