"""A PLC's program permits robolink to read where its tip touches, to write, and to test.

The permit (``xPermit``) is all that a program tells a client of the profile ``tools`` of its own
accord. While a contact gives it, its coming says that the tip, clear before, touches now
(docs/plc-callback.md). Nothing moves from here.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.controllers.softmotion.controller import MACHINE_WAITS
from robolink.errors import CalibrationError, ConfigError, LeaseHeldError, RobolinkError
from robolink.messages import known_names, tr
from robolink.model import Controller, EntryKind, NewEntry, Pose, ToolOffset, plain_offset
from robolink.serving._callback_journal import CALLED_BACK
from robolink.serving._callback_limits import CallbackLimits, believed
from robolink.serving._pin_measure import LEAST_PROOFS, LEAST_TOUCHES, touches_by
from robolink.serving._program_measure import facts_for_program, proved, statements_on_record
from robolink.timing import Deadline
from robolink.transaction import ToolChange, Wanted

if TYPE_CHECKING:
    from robolink.calibration import CalibrationResult
    from robolink.config import Cell

_AGAIN_S: Final = 1.0

PERMIT_METHODS: Final = ("n-angle", "pivot")

_SEEN: Final = ("1", "1")
"""The permit was off at the look before, and is on now."""


@dataclass(frozen=True, slots=True)
class PermitPlan:
    """The actions of a PLC's program, as agreed by both sides.

    Attributes:
        tool: The slot that it measures.
        method: ``n-angle`` or ``pivot``.
        touches: How often it touches before the value is written.
        proofs: How often afterwards.
        patience_s: How long the next touch may take.
        look_s: How often the PLC is looked at meanwhile. The program holds each touch, and what
            comes between two, for several of these.

    Raises:
        ConfigError: Too few touches or proofs, or no such method.
    """

    tool: int
    method: str = "n-angle"
    touches: int = 5
    proofs: int = LEAST_PROOFS
    patience_s: float = 60.0
    look_s: float = 0.2

    def __post_init__(self) -> None:
        if self.method not in PERMIT_METHODS:
            raise ConfigError(
                tr("There is no calibration method {name!r}.", name=self.method),
                remedy=known_names(PERMIT_METHODS),
            )
        if self.touches < LEAST_TOUCHES or self.proofs < LEAST_PROOFS:
            raise ConfigError(
                tr(
                    "{touches} touches and {proofs} turn tests are too few; {least} "
                    "and {least_proofs} are needed.",
                    touches=self.touches,
                    proofs=self.proofs,
                    least=LEAST_TOUCHES,
                    least_proofs=LEAST_PROOFS,
                ),
                remedy=tr("Let the PLC's program touch that often, and state the same numbers."),
            )


def free_machine(controller: Controller, *, patience_s: float = 12.0) -> None:
    """Take a mailbox, so that it is released at the end of the session.

    A process that was killed after its change was on record as settled never gave it back, and the
    machine's program still waits for that. What is not settled keeps it blocked.

    Args:
        controller: The PLC, connected.
        patience_s: How long to wait for an owner that fell silent; 10 s free a mailbox.

    Raises:
        ConfigError: It is no mailbox.
        LeaseHeldError: Another client owns it, and is at work.
    """
    from robolink.controllers import SoftMotionController

    if not isinstance(controller, SoftMotionController):
        raise ConfigError(
            tr("{controller} has no mailbox.", controller=controller.identity),
            remedy=tr("Name a PLC whose URL begins with softmotion+."),
        )
    deadline = Deadline.after(controller.clock, patience_s)
    while True:
        try:
            controller.take()
        except LeaseHeldError:
            if deadline.expired:
                raise
            controller.clock.sleep(_AGAIN_S)
        else:
            return


class PermitCall:
    """One calibration requested by a PLC's program, over one connection.

    Args:
        controller: The PLC, connected. Closed afterwards, it is given back, unless something is
            not settled.
        plan: What its program does.
        limits: What its touches are held to.
        ended: Asked at each look whether to give up.
        cell: The cell, whose file may state rows of the budget; ``None`` where none is named.

    Example:
        >>> import itertools, math
        >>> import robolink
        >>> from robolink.serving import CallbackLimits, PermitCall, PermitPlan
        >>> from robolink_simulators.hosting.in_process.softmotion import simulator_named
        >>> controller = robolink.connect("softmotion+sim://permit-example")
        >>> plc = simulator_named("permit-example")
        >>> looks, world = itertools.count(), plc.world
        >>> turns_deg = iter((0, -60, -60, -30, 60, 60, -105))  # five touches, two proofs
        >>> def program():  # of the PLC, at each look: clear of the pin, later on it
        ...     look = next(looks) % 12
        ...     if look == 0:
        ...         plc.panel.withdraw_permit()
        ...         world.robot.turn(next(turns_deg))
        ...         world.robot.carry(world.tips[1], world.gap_mm())
        ...     if look == 5:
        ...         plc.panel.give_permit()
        ...     return False
        >>> plan, limits = PermitPlan(tool=1), CallbackLimits()
        >>> with controller:
        ...     kept = PermitCall(controller, plan, limits, ended=program).answer()
        >>> tip = world.tips[1]
        >>> math.hypot(kept.x_mm - tip.x_mm, kept.y_mm - tip.y_mm) < 0.001
        True
    """

    def __init__(
        self,
        controller: Controller,
        plan: PermitPlan,
        limits: CallbackLimits,
        *,
        ended: Callable[[], bool] = lambda: False,
        cell: "Cell | None" = None,
    ) -> None:
        self._controller, self._plan, self._limits = controller, plan, limits
        self._ended, self._cell = ended, cell
        self._touches = touches_by(plan.method, limits)

    def answer(self) -> ToolOffset | None:
        """Wait for the touches, write, test, and keep the value or restore the old one.

        Returns:
            The value that is kept; ``None`` where nobody called.

        Raises:
            CalibrationError: Nothing was kept; its code says why. It is on record.
            RobolinkError: The write, or putting back, went wrong; the error says what stands.
        """
        first = self._touch(None)
        if first is None:
            return None
        try:
            return self._calibrated(first)
        except RobolinkError as error:
            self._note_refusal(error)
            raise

    def _calibrated(self, first: Pose) -> ToolOffset:
        plan, tools = self._plan, self._controller.tools
        before = tools.read(plan.tool)
        if before is None:
            raise CalibrationError(
                "tool_undefined", tr("Tool {tool} is not defined.", tool=plan.tool)
            )
        self._take(first, before, proof=False)
        for _ in range(1, plan.touches):
            self._take(self._next(), before, proof=False)
        found = self._touches.solve(before)
        recall = self._controller.outcomes.recorded
        facts = facts_for_program(recall, self._cell, found, self._touches)
        result = believed(found, before, self._limits_here, facts)
        wanted = Wanted(plan.tool, result.offset, before, details=self._details(result))
        marked = {MACHINE_WAITS: True}
        with ToolChange(self._controller, (wanted,), verify=True, marked=marked) as change:
            (receipt,) = change.write()
            written = receipt.read_back or result.offset
            for _ in range(plan.proofs):
                self._take(self._next(), written, proof=True)
            proved(self._touches, result, written, facts)
            change.keep(tr("confirmed by what the program touched after the write"))
        return written

    @property
    def _limits_here(self) -> CallbackLimits:
        """The limits, with no larger change than the cell allows: nobody is there to accept one."""
        allowed_mm = self._controller.change_guard.limits.length_mm
        if allowed_mm is None or allowed_mm >= self._limits.max_change_mm:
            return self._limits
        return replace(self._limits, max_change_mm=allowed_mm)

    def _take(self, pose: Pose, held: ToolOffset, *, proof: bool) -> None:
        from robolink.calibration import flange_poses

        (flange,) = flange_poses([pose], tools={self._plan.tool: held})
        if flange.tool:
            raise CalibrationError(
                "tool_pose", tr("A pose was taken in tool {tool}.", tool=flange.tool)
            )
        self._touches.add(flange, _SEEN, proof=proof)

    def _next(self) -> Pose:
        pose = self._touch(self._plan.patience_s)
        if pose is None:
            raise CalibrationError("no_touch", tr("The next touch did not come in time."))
        return pose

    def _touch(self, patience_s: float | None) -> Pose | None:
        """Return the pose at the next touch; ``None`` if it did not come.

        It counts where the permit was off at a look before, and the group stands still.
        """
        controller, clear = self._controller, False
        deadline = None if patience_s is None else Deadline.after(controller.clock, patience_s)
        while not self._ended() and not (deadline is not None and deadline.expired):
            status = controller.status()
            clear = clear or not status.remote
            if clear and status.remote and status.ready:
                return self._stood(controller)
            controller.clock.sleep(self._plan.look_s)
        return None

    def _stood(self, controller: Controller) -> Pose:
        """Return where it is, once two reads show no change."""
        selected, pose = controller.tools.selected(), controller.groups[0].pose()
        again, status = controller.groups[0].pose(), controller.status()
        if pose != again or not (status.remote and status.ready):
            raise CalibrationError("not_still", tr("The tip did not stay at its touch."))
        if controller.condition().get("tool_known") is not True:
            raise CalibrationError(
                "tool_pose", tr("The selected tool is not the one that was chosen here.")
            )
        return replace(pose, tool=selected)

    def _details(self, result: "CalibrationResult") -> dict[str, object]:
        return {
            CALLED_BACK: True,
            "method": result.method,
            "proposed": plain_offset(result.offset),
            **self._touches.on_record(),
            **statements_on_record(result),
        }

    def _note_refusal(self, error: RobolinkError) -> None:
        code = error.code if isinstance(error, CalibrationError) else type(error).__name__
        entry = NewEntry(
            EntryKind.REFUSED,
            tool=self._plan.tool,
            verdict=error.what,
            details={"code": code, CALLED_BACK: True},
        )
        try:
            self._controller.outcomes.append(entry)
        except ConfigError:
            return  # the work in progress matters more than a failure to record it
