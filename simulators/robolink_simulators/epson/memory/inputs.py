"""Inputs: switched by hand, by the tip of a nozzle, and those that latch a position.

The latch of a robot's position by an input: SetLatch, LatchEnable (docs/reference/spel.md 7.1).

Hardware does it: the position is that of the edge itself, however seldom a program looks.
"""

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, NamedTuple

from robolink.model import Pose, ToolOffset, rotate_xy
from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import turned
from robolink_simulators.cell.places import Direction, XyzMm, axis_of
from robolink_simulators.cell.tip_switches import (
    STANDING,
    UPRIGHT,
    Lean,
    MeasuredSwitch,
    Shaft,
    Shake,
    TipSwitch,
    meets,
)
from robolink_simulators.epson.arm.arm import Arm
from robolink_simulators.epson.arm.kinematics import frame_of, tip_place
from robolink_simulators.epson.arm.robots import Joints, RobotModel
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.bits import BitBank

_COUNTERS: Final = 16
_HIGHEST_COUNT: Final = 65535
"""Count at which a counter stops (docs/reference/spel.md 8; the behaviour above it is not
documented).
"""

Sense = Callable[[int | None], bool]
"""Returns the state of an input at an instant of the current motion, or now for ``None``."""

InputsAsked = dict[int, bool]
"""States of the inputs that were read, by number."""

_ROUNDING_MM: Final = 0.001
"""Part of a leeway that is not used: far more than rounding, or the turn that it leaves, takes."""


class InputBits(BitBank):
    """Inputs of a controller.

    Attributes:
        listeners: Told of each input that is switched by hand, and whether it is on now.
    """

    def __init__(self, size: int) -> None:
        super().__init__(size)
        self._senses: dict[int, Sense] = {}
        self._instant_ns: int | None = None
        self._asked: InputsAsked | None = None
        self._counts: dict[int, int] = {}
        self.listeners = list[Callable[[int, bool], None]]()

    @property
    def connected(self) -> bool:
        """Whether any input follows the robot."""
        return bool(self._senses)

    @property
    def instant_ns(self) -> int | None:
        """The instant that is observed inside :meth:`as_at`, ``None`` for the present."""
        return self._instant_ns

    def follows(self, number: int) -> bool:
        """Return whether an input follows what the robot meets."""
        return number in self._senses

    def connect(self, number: int, sense: Sense) -> None:
        """Let an input follow something whose state depends on where the robot is.

        Raises:
            Refusal: There is no such input.
        """
        self._check(number)
        self._senses[number] = sense

    def get(self, number: int) -> bool:
        """Return one bit; see :class:`BitBank`."""
        sense = self._senses.get(number)
        on = super().get(number) if sense is None else sense(self._instant_ns)
        if self._asked is not None:
            self._asked[number] = on
        return on

    def set(self, number: int, on: bool) -> None:
        """Switch one bit by hand; this disconnects it."""
        rises = on and not super().get(number)
        super().set(number, on)
        self._senses.pop(number, None)
        if rises and number in self._counts:
            self._counts[number] = min(self._counts[number] + 1, _HIGHEST_COUNT)
        for listener in self.listeners:
            listener(number, on)

    def set_byte(self, port: int, value: int) -> None:
        """Switch eight bits by hand."""
        if not 0 <= value <= 0xFF:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"Not a byte: {value}")
        self._check_byte(port)
        for bit in range(8):
            self.set(8 * port + bit, bool(value >> bit & 1))

    def count_from_zero(self, number: int) -> None:
        """Count an input from now on (CTReset): up to 16 inputs at a time.

        Raises:
            Refusal: There is no such input, 16 others are counted, or it follows what the robot
                meets, whose edges are not counted here.
        """
        self._check(number)
        if number in self._senses:
            raise SpelRefusal(RefusalKind.NOT_SIMULATED, "A counter of a sensor at the tip")
        if number not in self._counts and len(self._counts) >= _COUNTERS:
            raise SpelRefusal(RefusalKind.COUNTERS_USED, f"There are {_COUNTERS} counters")
        self._counts[number] = 0

    def counted(self, number: int) -> int:
        """Return how often an input was switched on since it is counted (Ctr), 0 if it is not."""
        self._check(number)
        return self._counts.get(number, 0)

    @contextmanager
    def as_at(self, instant_ns: int) -> Iterator[None]:
        """Read inputs inside the block as they are at an instant of the motion in progress."""
        self._instant_ns = instant_ns
        try:
            yield
        finally:
            self._instant_ns = None

    def show(self, asked: InputsAsked, instant_ns: int) -> bool:
        """Return whether inputs show at an instant of the motion in progress what they showed."""
        # No ``with`` block: a search would enter one every millisecond.
        before_ns, self._instant_ns = self._instant_ns, instant_ns
        try:
            return all(self.get(number) is on for number, on in asked.items())
        finally:
            self._instant_ns = before_ns

    def last_until(self, asked: InputsAsked, instant_ns: int) -> int:
        """Return until when inputs surely show what they show at an instant of the motion.

        Those that are switched by hand stay as they are.

        Args:
            asked: The inputs.
            instant_ns: The instant; it is returned where more is not known.
        """
        senses = [self._senses[number] for number in asked if number in self._senses]
        return min(
            (
                sense.lasts_until(instant_ns) if isinstance(sense, TipInput) else instant_ns
                for sense in senses
            ),
            default=instant_ns,
        )

    @contextmanager
    def noting(self) -> Iterator[InputsAsked]:
        """Note which inputs are read inside the block, and what they showed."""
        self._asked = asked = InputsAsked()
        try:
            yield asked
        finally:
            self._asked = None


def first_between(before_ns: int, after_ns: int, holds: Callable[[int], bool]) -> int:
    """Return the first instant at which a condition is true, to the nanosecond."""
    while after_ns - before_ns > 1:
        middle_ns = (before_ns + after_ns) // 2
        if holds(middle_ns):
            after_ns = middle_ns
        else:
            before_ns = middle_ns
    return after_ns


@dataclass(frozen=True, slots=True)
class Nozzle:
    """What is mounted.

    Attributes:
        tip: Where its tip is, seen from the flange.
        shaft: How it leans, in the flange's axes.
    """

    tip: ToolOffset | None
    shaft: Shaft


class TipInput:
    """Implements :data:`~robolink_simulators.epson.memory.inputs.Sense`.

    Args:
        switch: What the tip meets.
        arm: Which carries the nozzle.
        nozzle: Tells what is mounted.
        beside: Tells where the switch meets a place of the base; it may have been moved.
        latency_s: How late the input follows.
        noise_mm: Standard deviation, per axis, of where it switches; drawn anew for each
            motion.
        rng: Source of that noise.
    """

    def __init__(
        self,
        switch: TipSwitch,
        arm: Arm,
        nozzle: Callable[[], Nozzle],
        *,
        beside: Callable[[TipSwitch, XyzMm], XyzMm],
        latency_s: float,
        noise_mm: float,
        rng: random.Random,
    ) -> None:
        self._switch = switch
        self._arm = arm
        self._nozzle = nozzle
        self._beside = beside
        self._latency_ns = round(latency_s * NS_PER_S)
        self._shake = Shake(noise_mm, rng)
        # Determined once: asking a protocol costs more than an input.
        self._measured = switch if isinstance(switch, MeasuredSwitch) else None

    def __call__(self, instant_ns: int | None) -> bool:
        """Return whether the input is on at an instant of the motion, ``None`` for now."""
        arm, nozzle = self._arm, self._nozzle()
        if instant_ns is None:
            flange = arm.true_flange()
        else:
            flange = arm.true_flange_at(instant_ns - self._latency_ns)
        place, shaft = self._place(flange, nozzle), nozzle.shaft
        return meets(
            self._switch,
            place,
            _way(arm.model, flange, nozzle.tip, shaft.lean),
            bent_up_to_mm=shaft.bent_up_to_mm,
            upright=lambda: _way(arm.model, flange, nozzle.tip, UPRIGHT),
        )

    def lasts_until(self, instant_ns: int) -> int:
        """Return until when the input surely is as it is at an instant of the motion.

        A search asks for thousands of instants, far from the switch most of them: so long as the
        nozzle cannot get there nothing needs to be asked.

        Args:
            instant_ns: The instant; it is returned where more is not known.
        """
        arm, nozzle = self._arm, self._nozzle()
        if self._measured is None or nozzle.shaft.bent_up_to_mm:
            return instant_ns
        then_ns = instant_ns - self._latency_ns
        flange = arm.true_flange_at(then_ns)
        way = _way(arm.model, flange, nozzle.tip, nozzle.shaft.lean)
        leeway_mm = self._measured.leeway_mm(self._place(flange, nozzle), way)
        return arm.within_until(then_ns, leeway_mm - _ROUNDING_MM) + self._latency_ns

    def _place(self, flange: Pose, nozzle: Nozzle) -> XyzMm:
        """Return where the tip is, seen from where the switch was mounted, scatter included."""
        x_mm, y_mm, z_mm = tip_place(self._arm.model, flange, nozzle.tip)
        dx_mm, dy_mm, dz_mm = self._shake.of(self._arm.moves_started)
        return self._beside(self._switch, (x_mm + dx_mm, y_mm + dy_mm, z_mm + dz_mm))


def _way(model: RobotModel, flange: Pose, tip: ToolOffset | None, lean: Lean) -> Direction:
    """Return the direction of a leaning shaft, in base axes.

    A SCARA's flange looks up with its Z axis, so the shaft goes along it, less its lean; six axes
    look out of the flange, and the shaft comes back along the tool's own Z.
    """
    if not model.six_axes:
        if lean == UPRIGHT:
            return STANDING
        return (*rotate_xy(*lean, flange.u_deg), 1.0)
    x, y, z = axis_of(tip or ToolOffset(), "z")
    lean_x, lean_y = lean
    return turned(frame_of(flange).rotation, (lean_x - x, lean_y - y, -z))


PORTS: Final = range(24, 28)
"""Numbers of the inputs that can trigger a latch (documented)."""

MOST_TIMES: Final = 4
_SAMPLE_NS: Final = 1_000_000
"""Pulses of an input at the tip that are shorter than this, in ns, are missed (assumed)."""


class LatchSetting(NamedTuple):
    """What SetLatch has set.

    Attributes:
        port: The input.
        rising: Whether the edge that counts is the one to On.
        times: How many positions are taken.
    """

    port: int
    rising: bool
    times: int


class PositionLatch:
    """Stores the joints of an arm at edges of an input.

    Args:
        arm: Whose joints.

    Attributes:
        taken: The joints at each edge since it was enabled.
        enabled: Whether it looks out for edges.
    """

    def __init__(self, arm: Arm) -> None:
        self.taken = list[Joints]()
        self.enabled = False
        self._arm = arm
        self._inputs: InputBits | None = None
        self._setting: LatchSetting | None = None
        self._level = False

    def listen(self, inputs: InputBits) -> None:
        """Look at the inputs of a controller."""
        self._inputs = inputs
        inputs.listeners.append(self._switched)

    @property
    def complete(self) -> bool:
        """Whether the requested number of positions is stored (LatchState)."""
        return self._setting is not None and len(self.taken) >= self._setting.times

    def set(self, port: int, *, rising: bool, times: int) -> None:
        """Say which edges of which input count, and how many.

        Raises:
            Refusal: The input cannot trigger a latch, or there are not so many positions.
        """
        if port not in PORTS:
            raise SpelRefusal(RefusalKind.IO_BIT, f"Input {port} triggers no latch")
        if not 1 <= times <= MOST_TIMES:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"{times} positions")
        self._setting = LatchSetting(port, rising, times)

    def enable(self, on: bool) -> None:
        """Start to watch, with no position stored, or stop; stored positions stay (assumed).

        Raises:
            Refusal: It was not said for what (documented that SetLatch comes before it).
        """
        if on:
            if self._setting is None or self._inputs is None:
                raise SpelRefusal(RefusalKind.LATCH_UNSET, "SetLatch has not been carried out")
            self.taken = []
            self._level = self._inputs.get(self._setting.port)
        self.enabled = on
        self._arm.followed = self._follow if on else None

    def forget(self) -> None:
        """Forget all, as power-off does (assumed)."""
        self.enabled, self._setting, self.taken = False, None, []
        self._arm.followed = None

    def position(self, number: int) -> Joints:
        """Return where the arm was at an edge, 1 for the first.

        Raises:
            Refusal: There was none (the number of that error is assumed).
        """
        if not 1 <= number <= MOST_TIMES:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"There is no latch {number}")
        if number > len(self.taken):
            raise SpelRefusal(RefusalKind.POINT_UNDEFINED, f"Position {number} is not latched")
        return self.taken[number - 1]

    def _switched(self, number: int, on: bool) -> None:
        """An input was switched by hand."""
        if self.enabled and self._setting is not None and number == self._setting.port:
            self._meet(on, self._arm.joints)

    def _meet(self, on: bool, joints: Joints) -> None:
        edge, self._level = on != self._level, on
        setting = self._setting
        if edge and setting is not None and on == setting.rising and not self.complete:
            self.taken.append(joints)

    def _follow(self, since_ns: int, until_ns: int) -> None:
        """Look at what an input at the tip has shown on the way."""
        setting, inputs = self._setting, self._inputs
        if setting is None or inputs is None or not inputs.follows(setting.port):
            return

        def changed(instant_ns: int) -> bool:
            with inputs.as_at(instant_ns):
                return inputs.get(setting.port) != self._level

        before_ns = since_ns
        while before_ns < until_ns and not self.complete:
            after_ns = min(before_ns + _SAMPLE_NS, until_ns)
            if changed(after_ns):
                edge_ns = first_between(before_ns, after_ns, changed)
                self._meet(not self._level, self._arm.position_at(edge_ns))
            before_ns = after_ns
