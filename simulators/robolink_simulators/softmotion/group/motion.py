"""What moves the axes of a group: movements, a jog, or single axes."""

from collections.abc import Callable, Iterable, Sequence

from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.axes import Axis
from robolink_simulators.softmotion.group.jog import JogMotion
from robolink_simulators.softmotion.group.movement import EdgeWatch, Movement, MovementQueue
from robolink_simulators.softmotion.group.paths import require_inside
from robolink_simulators.softmotion.kinematics.kinematics import AxisValues
from robolink_simulators.softmotion.options import GroupOptions
from robolink_simulators.softmotion.signals import DigitalInputs
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind, SmcError

_HALVINGS = 40


class GroupMotion:
    """The axes, and what is in progress on them.

    Args:
        axes: Gives the drives that belong to the kinematics.
        inputs: What movements until an input watch.
        options: The group's habits.

    Attributes:
        queue: The movements.
        jog: The jog under way.
        interrupted: What an interrupt left to continue.
        interrupted_at: Where the axes stood then.
        interrupting: Whether an interrupt is bringing the group to rest.
    """

    def __init__(
        self, axes: Callable[[], tuple[Axis, ...]], inputs: DigitalInputs, options: GroupOptions
    ) -> None:
        self._axes = axes
        self._inputs = inputs
        self._options = options
        self._cycle_ns = options.cycle_us * 1000
        self._singles: list[tuple[Axis, BlockExecution]] = []
        self.queue = MovementQueue(self._cycle_ns)
        self.jog: JogMotion | None = None
        self.interrupted: list[Movement] = []
        self.interrupted_at: AxisValues = ()
        self.interrupting = False

    @property
    def values(self) -> AxisValues:
        """Where the axes are."""
        return tuple(axis.value for axis in self._axes())

    @property
    def resting(self) -> bool:
        """Whether no movement and no jog is in progress; an interrupted one rests."""
        if self.jog is not None:
            return False
        return not self.queue.running if self.interrupting else self.queue.empty

    def start_alone(
        self, axis: Axis, target: float, execution: BlockExecution, *, now_ns: int
    ) -> None:
        """Begin a single movement of an axis.

        Raises:
            Refused: The axis cannot do it.
        """
        axis.start_alone(target, now_ns)
        for other, earlier in self._singles:
            if other is axis:
                earlier.abort()
        execution.activate()
        self._singles.append((axis, execution))

    def brake(self, now_ns: int) -> None:
        """Abort every movement and jog and stop."""
        self.queue.take_over(now_ns)
        self.abandon_interrupted()
        if self.jog is not None:
            self.jog.execution.abort()
            self.jog.release()

    def end_jog(self) -> None:
        """End a jog at once, because a movement takes over (assumed: without slowing down)."""
        if self.jog is not None:
            self.jog.execution.abort()
            self.jog = None

    def interrupt(self, now_ns: int) -> None:
        """Stop on the path and keep what is left of it."""
        self.interrupting = True
        self.queue.brake(now_ns)

    def keep_interrupted(self) -> None:
        """Lay aside what had not begun when the group came to rest."""
        self.interrupting = False
        self.interrupted += self.queue.drop()
        self.interrupted_at = self.values

    def resume(self, now_ns: int) -> None:
        """Continue what was interrupted."""
        self.queue.resume(self.interrupted, now_ns)
        self.interrupted = []

    def abandon_interrupted(self) -> None:
        """End interrupted movements with CommandAborted."""
        self.interrupting = False
        for movement in self.interrupted:
            movement.execution.abort()
        self.interrupted = []

    def drop(self, error: SmcError | None) -> None:
        """End everything where it is: with CommandAborted, queued movements with ``error``."""
        for movement in (*self.interrupted, *self.queue.drop()):
            if error is None:
                movement.execution.abort()
            else:
                movement.execution.fail(error)
        self.interrupted = []
        self.interrupting = False
        self.end_jog()
        self.abort_singles(self._axes())

    def abort_singles(self, axes: Sequence[Axis]) -> None:
        """End the single movements of some axes where they are."""
        for axis, execution in self._singles:
            if axis in axes:
                axis.halt()
                execution.abort()
        self._end_singles()

    def follow(self, now_ns: int) -> None:
        """Put the axes where they are at an instant in which nothing ends or begins.

        Raises:
            Refused: A blended corner leaves the workspace.
        """
        if self._singles:
            for axis in self._axes():
                axis.advance(now_ns)
        values = self.queue.axes_at(now_ns)
        if values is not None:
            if len(self.queue.running) > 1:
                require_inside(values, self._axes())  # a whole line was checked, a corner was not
            self._place(values)

    def step(self, now_ns: int) -> None:
        """Do one cycle of the motion task.

        Raises:
            Refused: A blended corner leaves the workspace.
        """
        self.follow(now_ns)
        self._end_singles()
        self._look_for_edges(now_ns, self.queue.running)
        for movement in self.queue.settle(now_ns):
            self._end(movement)
        if not self.interrupting:
            began = self.queue.start_due(now_ns)
            if began is not None:
                self._look_for_edges(now_ns, (began,))
        if self.jog is not None and not self.queue.running:
            self._step_jog(self.jog)

    def next_change(self, now_ns: int) -> int | None:
        """Return when something ends or begins; every cycle where each has to be looked at."""
        running = self.queue.running
        if self.jog is not None or len(running) > 1 or (running and running[0].watch):
            cycle_ns = (now_ns // self._cycle_ns + 1) * self._cycle_ns
        elif not self._singles:
            return self.queue.next_change(now_ns)
        else:
            cycle_ns = None
        changes = [cycle_ns, self.queue.next_change(now_ns)]
        if self._singles:
            changes += [axis.next_change() for axis in self._axes()]
        return min((change for change in changes if change is not None), default=None)

    def _place(self, values: AxisValues) -> None:
        for axis, value in zip(self._axes(), values, strict=True):
            axis.value = value

    def _end(self, movement: Movement) -> None:
        if self.interrupting and movement.unfinished:
            self.interrupted.append(movement)
        elif movement.watch is not None and not movement.latched:
            error = self._options.numbers.error(ErrorKind.NO_EDGE, "The input did not change")
            movement.execution.fail(error)
        else:
            movement.execution.finish()

    def _end_singles(self) -> None:
        for axis, execution in self._singles:
            if not axis.moving_alone:
                execution.finish()
        self._singles = [single for single in self._singles if not single[1].ended]

    def _step_jog(self, jog: JogMotion) -> None:
        try:
            self._place(jog.step(self.values, self._cycle_ns))
        except BlockRefused as refused:
            jog.execution.fail(self._options.numbers.error(refused.kind, refused.text))
            self.jog = None
            return
        if jog.resting:
            jog.execution.finish()
            self.jog = None

    def _look_for_edges(self, now_ns: int, movements: Iterable[Movement]) -> None:
        for movement in movements:
            watch = movement.watch
            if watch is None or movement.latched:
                continue
            if not self._met(watch, self.values):
                movement.armed = True
            elif movement.armed:
                movement.latch(self._latched_axes(watch, now_ns))
                if watch.stops:
                    movement.brake(now_ns)

    def _met(self, watch: EdgeWatch, axes: AxisValues) -> bool:
        return self._inputs.read(watch.number, axes) is not watch.falling

    def _latched_axes(self, watch: EdgeWatch, now_ns: int) -> AxisValues:
        if self._options.latch == "cycle":
            return self.values
        before_ns, after_ns = now_ns - self._cycle_ns, now_ns
        for _ in range(_HALVINGS):
            middle_ns = (before_ns + after_ns) // 2
            axes = self.queue.axes_at(middle_ns)
            if axes is not None and self._met(watch, axes):
                after_ns = middle_ns
            else:
                before_ns = middle_ns
        return self.queue.axes_at(after_ns) or self.values
