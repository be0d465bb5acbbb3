"""tool list, get, set, clear, select: the tool table."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import click

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink_cli.access.warnings import note_change
from robolink_cli.console.render import emit, json_is_on, note, say, show_requests
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.consent import (
    DryRun,
    Published,
    ThenSelect,
    Yes,
)
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.prompts.questions import AcceptedAngle, AcceptedLength, accepted_jump, agree
from robolink_cli.session.completion import complete_tool
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext, controller_options
from robolink_cli.session.order import (
    OrderId,
    ordered,
    require_no_dry_run,
    show_done,
    with_order,
)

if TYPE_CHECKING:
    from robolink.model import Controller, ToolOffset, ToolReceipt
    from robolink.transaction import Order

_FROM_FILES = "robolink_cli.commands.controller.backup"

_BESIDES = {
    "impact": (
        "robolink_cli.commands.measure.impact:impact",
        declared("Show how far a tool change moves the tip at taught points."),
    ),
    "backup": (f"{_FROM_FILES}:backup", declared("Save all tools to a file.")),
    "restore": (f"{_FROM_FILES}:restore", declared("Restore the tools of a backup.")),
    "compare": (
        f"{_FROM_FILES}:compare",
        declared("Show the differences from a backup; exit code 1 if any."),
    ),
}


_Number = Annotated[int, CliArgument(shell_complete=complete_tool)]


@click.group(cls=LazyGroup, lazy=_BESIDES)
def tool() -> None:
    """Read and change the tool offsets stored in the controller."""


@tool.command("list")
@controller_options
def list_tools(
    context: CliContext,
    *,
    published: Published = False,
) -> None:
    """Show all tools and which one is selected."""
    from robolink.model import json_value
    from robolink_cli.session.context import find_tools
    from robolink_cli.views.documents import show_tools

    with open_controller(context, looks=True) as controller:
        found = find_tools(controller, published=published)
    tools = {str(number): json_value(offset) for number, offset in found.tools.items()}
    payload: dict[str, object] = {"selected_tool": found.selected, "tools": tools}
    payload["source"] = "published" if published else "controller"
    emit("tools", payload, lambda: show_tools(tools, found.selected))


@tool.command("get")
@controller_options
def get(
    context: CliContext,
    *,
    number: Annotated[int | None, CliArgument(shell_complete=complete_tool)] = None,
    mode: Annotated[
        Literal["set", "active", "last"] | None,
        CliOption(
            help="On a PLC, what SMC_GroupReadTool reports: the tool that is set, that of "
            "the present movement, or that of the last command."
        ),
    ] = None,
) -> None:
    """Show one tool; 0 is the flange."""
    from robolink.model import json_value
    from robolink_cli.views.documents import show_tools

    if (number is None) == (mode is None):
        raise ConfigError(
            tr("A tool number or --mode is missing."),
            remedy=tr("Write for example 'robolink tool get 1', or with a PLC --mode set."),
        )
    if number is None:
        _get_by_mode(context, str(mode))
        return
    with open_controller(context, looks=True) as controller:
        offset, selected = controller.tools.read(number), controller.tools.selected()
        if number:
            note_change(controller, number, offset)
    value = json_value(offset)
    payload: dict[str, object] = {
        "tool": number,
        "defined": value is not None,
        "offset": value,
        "selected": selected == number,
    }
    emit("tool", payload, lambda: show_tools({str(number): value}, selected))


def _get_by_mode(context: CliContext, mode: str) -> None:
    """Show what the PLC's own reading block says about the selected tool."""
    from robolink.model import json_value
    from robolink.protocols.mailbox import ReadMode
    from robolink_cli.access.capabilities import require_softmotion
    from robolink_cli.views.documents import show_offset

    modes = {"set": ReadMode.SET, "active": ReadMode.ACTIVE, "last": ReadMode.LAST_COMMANDED}
    with open_controller(context, looks=True) as controller:
        offset = require_softmotion(controller).tools.read_mode(modes[mode])
    value = json_value(offset)
    payload: dict[str, object] = {"mode": mode, "offset": value}
    emit("tool-mode", payload, lambda: show_offset(mode, value))


class _Components(NamedTuple):
    """The given components of an offset."""

    x: Annotated[float | None, CliOption(metavar="MM", help="mm from the flange.")] = None
    y: Annotated[float | None, CliOption(metavar="MM", help="mm from the flange.")] = None
    z: Annotated[float | None, CliOption(metavar="MM", help="mm from the flange.")] = None
    u: Annotated[float | None, CliOption(metavar="DEG", help="Degrees about Z.")] = None
    v: Annotated[
        float | None, CliOption(metavar="DEG", help="Degrees about Y; six-axis robots only.")
    ] = None
    w: Annotated[
        float | None, CliOption(metavar="DEG", help="Degrees about X; six-axis robots only.")
    ] = None


@tool.command("set")
@controller_options
def set_tool(
    context: CliContext,
    *,
    number: _Number,
    given: _Components,
    accepted_mm: AcceptedLength = None,
    accepted_deg: AcceptedAngle = None,
    order: OrderId = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Write a tool offset; components that you leave out stay.

    A change beyond the cell's max_change_mm or max_change_deg needs an engineer, who sees the
    figure and must confirm it, even with --yes.
    """
    from robolink.transaction import Wanted, change_tools

    units = {"x": "x_mm", "y": "y_mm", "z": "z_mm", "u": "u_deg", "v": "v_deg", "w": "w_deg"}
    changes = {units[axis]: value for axis, value in given._asdict().items() if value is not None}
    if not changes:
        raise ConfigError(
            tr("No component was given."),
            remedy=tr("Give at least one of --x --y --z --u --v --w."),
        )
    if order is not None:
        require_no_dry_run(order, dry_run=dry_run)
    setting = _Setting(
        context, number, changes, [name for name in units.values() if name not in changes]
    )
    with (
        open_controller(context, changes=not dry_run) as controller,
        nullcontext() if order is None else ordered(controller, order, "tool set") as found,
        ExitStack() as agreed,
    ):
        if found is not None and found.done is not None:
            payload = found.done.result
        else:
            before, wanted = setting.look_up(controller)
            guard = controller.change_guard
            jump = guard.beyond(before, wanted)
            if dry_run:
                if jump is not None:
                    note(guard.limits.figure(number, jump))
                show_requests(controller.tools.preview_write(number, wanted))
                return
            setting.show_change(controller, before, wanted)
            if jump is not None:
                agreed.enter_context(
                    accepted_jump(
                        controller,
                        number,
                        jump,
                        accepted_mm=accepted_mm,
                        accepted_deg=accepted_deg,
                    )
                )
            setting.ask(controller, agreed=jump is not None, yes=yes)
            receipts = change_tools(
                controller,
                [Wanted(number, wanted, before)],
                tell=note,
                order=found,
                describe=setting.document,
            )
            payload = setting.document(receipts)
    setting.show(payload, found)


class _Setting:
    """The options of ``tool set``, in the steps of its write."""

    def __init__(
        self, context: CliContext, number: int, changes: Mapping[str, float], kept: list[str]
    ) -> None:
        from robolink.model import ToolOffset

        # Check the numbers before connecting.
        ToolOffset(**changes)
        self._context, self._number, self._changes, self._kept = context, number, changes, kept

    def look_up(self, controller: "Controller") -> "tuple[ToolOffset | None, ToolOffset]":
        """Return the tool's present value, and its new one."""
        from robolink.model import ToolOffset

        controller.tools.require_writable(self._number)
        before = controller.tools.read(self._number)
        note_change(controller, self._number, before)
        # The values of an impossible tool are not kept beside the given ones.
        kept_from = ToolOffset() if before is None or before.of_no_tool else before
        return before, replace(kept_from, **self._changes)

    def show_change(
        self, controller: "Controller", before: "ToolOffset | None", wanted: "ToolOffset"
    ) -> None:
        """Show a person the tool's present value, and its new one."""
        from robolink_cli.views.documents import show_change

        controller.tools.selected()  # read now: the last line after a failure shows it
        if not json_is_on():
            show_change(self._number, before, wanted, after_name=tr("new"))

    def ask(self, controller: "Controller", *, agreed: bool, yes: bool) -> None:
        """Let a person agree who has not yet; back up before the first write."""
        from robolink.backup import keep_first_backup

        if not agreed:
            agree(
                tr(
                    "Write these values to tool {tool}? 'robolink undo' undoes it.",
                    tool=self._number,
                ),
                yes=yes,
                asks=not json_is_on(),
            )
        keep_first_backup(controller, tell=note)

    def document(self, receipts: "Sequence[ToolReceipt]") -> dict[str, object]:
        """Return the document of the write."""
        from robolink_cli.views.documents import receipt_payload

        (receipt,) = receipts
        return receipt_payload(receipt) | {"kept": self._kept}

    def show(self, payload: Mapping[str, object], order: "Order | None") -> None:
        """Show the result: of this write, or of the one that carried out the order."""
        skipped = tr("already stored, nothing was written")
        done = skipped if payload["skipped"] else tr("written, read back")

        def tell() -> None:
            if order is not None and order.done is not None:
                show_done(order)
            else:
                say(tr("tool {number}: {done}", number=self._number, done=done))

        shown = payload if order is None else with_order(payload, order)
        emit("tool-write", shown, tell)


@tool.command("clear")
@controller_options
def clear(
    context: CliContext,
    *,
    number: _Number,
    then_select: ThenSelect = None,
    order: OrderId = None,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Remove a tool's definition. If the cell names people, this needs an engineer.

    The selected tool is cleared only with --then-select: the machine then uses that tool.
    """
    require_no_dry_run(order, dry_run=dry_run)
    with (
        open_controller(context, changes=not dry_run) as controller,
        ordered(controller, order, "tool clear") as found,
    ):
        if found is not None and found.done is not None:
            payload = found.done.result
        elif dry_run:
            requests = controller.tools.preview_clear(number, then_select=then_select)
            show_requests(requests)
            return
        else:
            payload = _clear(controller, number, then_select, order=found, yes=yes)
    skipped, selected = payload["skipped"], payload["selected_tool"]
    done = tr("was undefined already") if skipped else tr("cleared, read back")

    def show() -> None:
        if found is not None and found.done is not None:
            show_done(found)
            return
        say(tr("tool {number}: {done}", number=number, done=done))
        if selected is not None:
            say(tr("Tool {tool} is selected.", tool=selected))

    emit("tool-clear", with_order(payload, found), show)


def _clear(
    controller: "Controller",
    number: int,
    then_select: int | None,
    *,
    order: "Order | None",
    yes: bool,
) -> Mapping[str, object]:
    """Ask, clear, and return the document."""
    from robolink.backup import keep_first_backup
    from robolink.transaction import Wanted, change_tools
    from robolink_cli.views.documents import receipt_payload

    before = controller.tools.read(number)
    # Refuse before asking a question.
    controller.tools.preview_clear(number, then_select=then_select)
    selected = controller.tools.selected()
    agree(_clear_question(number, then_select), yes=yes, asks=not json_is_on())
    keep_first_backup(controller, tell=note)
    gives_way = then_select is not None and selected == number
    left = then_select if gives_way else selected

    def document(receipts: "Sequence[ToolReceipt]") -> dict[str, object]:
        (receipt,) = receipts
        return receipt_payload(receipt) | {"selected_tool": left}

    receipts = change_tools(
        controller,
        [Wanted(number, None, before, then_select=then_select)],
        tell=note,
        order=order,
        describe=document,
        select=then_select if gives_way else None,
    )
    return document(receipts)


def _clear_question(number: int, then_select: int | None) -> str:
    if then_select is None:
        return tr("Clear tool {number}?", number=number)
    return tr(
        "Clear tool {number}? If it is selected now, tool {other} is selected instead.",
        number=number,
        other=then_select,
    )


@tool.command("select")
@controller_options
def select(
    context: CliContext,
    *,
    number: _Number,
    dry_run: DryRun = False,
    yes: Yes = False,
) -> None:
    """Select a tool; the choice survives power-off. 0 is the flange."""
    with open_controller(context, changes=not dry_run) as controller:
        before = controller.tools.selected()
        if dry_run:
            requests = controller.tools.preview_select(number)
            show_requests(requests)
            return
        if before != number:
            agree(
                tr("Select tool {number} instead of {before}?", number=number, before=before),
                yes=yes,
                asks=not json_is_on(),
            )
        controller.tools.select(number)
    payload: dict[str, object] = {"before": before, "selected_tool": number}
    emit(
        "tool-select",
        payload,
        lambda: say(
            tr("Tool {number} is selected (before: {before}).", number=number, before=before)
        ),
    )
