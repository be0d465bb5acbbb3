"""A simulated PLC with a mailbox as a device: words come and go, time passes.

Theory of operation. The device is given every instant at which something can change, in
order. It owns no thread and no clock: hosts hold :attr:`SoftMotionSimulator.lock`, hand it
what clients read and write, and the time. Several hosts may serve one PLC; they share the
words that clients write.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from robolink.model import ToolOffset
from robolink.protocols.mailbox import COMMAND, COMMAND_WORDS, SLOTS, Opcode, Six, Words
from robolink_simulators.cell.frames import zyx_angles
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.device.hosted import HostedDevice
from robolink_simulators.device.wire_record import MotionLog
from robolink_simulators.faults import LinkKind, PlcFault, PlcFaultAction
from robolink_simulators.softmotion.catalogue import MachineModel, machine_named
from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.mailbox.exchange import (
    ServedAccess,
    WireFaults,
    is_refused,
    shown_read,
    shown_write,
)
from robolink_simulators.softmotion.mailbox.option_text import PlcOptions
from robolink_simulators.softmotion.mailbox.panel import PlcMishaps, PlcPanel
from robolink_simulators.softmotion.mailbox.plc import Plc
from robolink_simulators.softmotion.mailbox.retained import RetainedFile
from robolink_simulators.softmotion.mailbox.watchdogs import FieldbusWatchdog
from robolink_simulators.softmotion.world import SoftMotionWorld
from robolink_simulators.state_files import StateNotKeptError

DEFAULT_KINEMATICS: Final = "Kin_Scara3_Z"

_TORN_S: Final = 0.02
"""Time in seconds between the halves of a torn write, unless the fault gives another."""

PlcMaker = Callable[[MachineModel, Mapping[str, float], PlcOptions], Plc]


class SoftMotionSimulator(HostedDevice):
    """One PLC, its mailbox, and the world around its robot.

    Args:
        kinematics: Name of the kinematics, with ``+Kin_CAxis`` where that is coupled.
        seed: Decides the world and every scatter; the same seed gives the same run.
        parameters: Of the kinematics and its drives.
        options: The PLC's habits.
        state_path: File that keeps what retained memory keeps.
        faults: What is planned to go wrong.
        world: What goes wrong around the robot.
        make_plc: Makes the controller, from machine, parameters and options.
        answer_ms: How long after a request arrives its answer leaves, in simulated milliseconds.

    At first the machine stands ready: enabled, slot 1 defined and selected. With a state file
    of an earlier run it has just been switched on: without a tool and, in the profile
    ``full``, disabled.

    Attributes:
        options: The PLC's habits.
        plc: The controller.
        panel: What a person, or the machine's own program, can do.
        world: The truth, and the person at the machine.
        faults: What is planned to go wrong.

    Raises:
        ConfigError: No such kinematics or parameter, or a state file that does not fit.

    Example:
        >>> import robolink
        >>> from robolink_simulators.hosting.in_process.softmotion import register, unregister
        >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
        >>> simulator = SoftMotionSimulator("Kin_Scara3_Z", seed=7)
        >>> with robolink.connect(register("plc-example", simulator)) as controller:
        ...     controller.tools.selected()
        1
        >>> unregister("plc-example")
    """

    kind = "softmotion"

    def __init__(
        self,
        kinematics: str = DEFAULT_KINEMATICS,
        *,
        seed: int = 1,
        parameters: Mapping[str, float] | None = None,
        options: PlcOptions | None = None,
        state_path: Path | None = None,
        faults: Iterable[PlcFault] = (),
        world: WorldParameters | None = None,
        make_plc: PlcMaker = Plc,
        answer_ms: float = 0.0,
    ) -> None:
        super().__init__(seed, answer_ms=answer_ms)
        self.durable = state_path is not None
        self.options = options or PlcOptions()
        self.faults = WireFaults(faults, seed)
        self._kinematics, self._given = kinematics, dict(parameters or {})
        self._parameters, self._state_path, self._make_plc = world, state_path, make_plc
        self._make()
        self._count_on()

    def _make(self) -> None:
        """Make the controller and its world, as they are at first."""
        self._watchdog = FieldbusWatchdog(self.options.mailbox.watchdog_ms, self.wire_time)
        self._overtaken: list[tuple[int, Words]] = []
        given = dict(self._given)
        model = machine_named(self._kinematics, given)
        self.plc = self._make_plc(model, given, self.options)
        self.plc.wire_time = self.wire_time
        self.world = SoftMotionWorld.seeded(self.plc.group, self.seed, self._parameters)
        self.panel = PlcPanel(self.plc, self.acting)
        self._mishaps = PlcMishaps(self.panel)
        self._file = RetainedFile(self._state_path, self.plc.memory, self._kinematics)
        switched_on = self._file.restore()
        self.plc.start(self.now_ns)
        if not switched_on:
            self._make_ready()
        self._file.save_changes()

    @property
    def failure(self) -> StateNotKeptError | None:
        """See :attr:`HostedDevice.failure`."""
        return self._file.failure

    @property
    def executes_program(self) -> bool:
        """See :attr:`HostedDevice.executes_program`."""
        return self.plc.executes_program

    @property
    def machine_name(self) -> str:
        """See :attr:`HostedDevice.machine_name`."""
        return f"{self.kind} {self._kinematics}"

    def _counted(self) -> dict[str, int]:
        return {
            "moves_started": self.plc.group.movements_started,
            "tool_writes": self._slot_changes(),
            "starts": self.plc.starts,
            "touches": self.world.operator.touches,
        }

    def _slot_changes(self) -> int:
        """How often the slots were written or cleared, ever since the PLC was new."""
        return sum(self.plc.memory.slot(number).counter for number in SLOTS)

    def _motion_log(self) -> MotionLog:
        return self.plc.group.motions

    def restart(self) -> None:
        """Restart the PLC; what is retained stays."""
        self.panel.restart()

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``, stopping wherever something changes."""
        # Most calls come at the same instant as the last one: nothing can have happened between.
        while now_ns > self.now_ns < (change := self.next_change() or now_ns) < now_ns:
            before_ns = self._presently_ns()
            self._step(change)
            self.plc.keep_pace(self._presently_ns() - before_ns)
        self._step(max(now_ns, self.now_ns))

    def _presently_ns(self) -> int:
        """The host's own time, which passes while this computer works."""
        return self.now_ns if self.present_ns is None else self.present_ns()

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""
        times = (
            self.plc.next_change(self.now_ns),
            self._mishaps.next_change(),
            self._watchdog.deadline_ns,
        )
        changes = [time_ns for time_ns in times if time_ns is not None]
        return min(changes) if changes else None

    def read(
        self, first: int, count: int, now_ns: int, link: LinkKind = LinkKind.MAILBOX_SIM
    ) -> ServedAccess:
        """Serve a client that reads words of response and slots, over a kind of link.

        Args:
            first: Number of the first word.
            count: How many.
            now_ns: When, on the clock of the simulated PLC.
            link: Over which kind of link, by which faults are told apart.

        Example:
            >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
            >>> access = SoftMotionSimulator(seed=7).read(0, 2, now_ns=0)
            >>> hex(access.words[0]), access.answered  # the version, as it stands on the wire
            ('0x100', True)
        """
        shown = shown_read(first, count)
        return self._serve(shown, now_ns, link, lambda _: self.plc.read(first, count, self.now_ns))

    def read_framed(self, now_ns: int) -> ServedAccess:
        """Serve a client that reads the response between its counts of cycles, over OPC UA."""
        return self._serve(
            "read_response", now_ns, LinkKind.OPCUA, lambda _: self.plc.framed(self.now_ns)
        )

    def write(
        self,
        first: int,
        words: Sequence[int],
        now_ns: int,
        link: LinkKind = LinkKind.MAILBOX_SIM,
    ) -> ServedAccess:
        """Serve a client that writes words of the command block.

        Args:
            first: Number of the first word.
            words: What is written.
            now_ns: When, on the clock of the simulated PLC.
            link: Over which kind of link, by which faults are told apart.

        Example:
            >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
            >>> SoftMotionSimulator(seed=7).write(0, [0x0100], now_ns=0).answered
            True
        """
        shown = shown_write(first, words, _opcode_name(words))
        return self._serve(shown, now_ns, link, lambda faults: self._take(first, words, faults))

    def read_back(
        self, first: int, count: int, now_ns: int, link: LinkKind = LinkKind.MAILBOX_SIM
    ) -> ServedAccess:
        """Serve a client that reads words of the command block, as clients wrote them.

        Requests read ``read_command``, and ``read_beat`` for the heartbeat alone; as :meth:`read`.

        Args:
            first: Number of the first word.
            count: How many.
            now_ns: When, on the clock of the simulated PLC.
            link: Over which kind of link, by which faults are told apart.

        Example:
            >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
            >>> SoftMotionSimulator(seed=7).read_back(62, 1, now_ns=0).words
            (0,)
        """
        shown = "read_command" if count == COMMAND_WORDS else "read_beat"
        taken = slice(first, first + count)
        return self._serve(shown, now_ns, link, lambda _: self.plc.program.inbox.words[taken])

    def snapshot(self, now_ns: int) -> ServedAccess:
        """Serve a client that has the response copied to where it reads it later, over CAN."""
        return self._serve(
            "snapshot", now_ns, LinkKind.CAN, lambda _: self.plc.response(self.now_ns)
        )

    def read_copy(self, words: Words, now_ns: int) -> ServedAccess:
        """Serve a client that reads a copy of the response that was made before, over CAN."""
        return self._serve(shown_read(0, len(words)), now_ns, LinkKind.CAN, lambda _: words)

    def hear(self, now_ns: int) -> None:
        """Note a valid request, for the fieldbus's watchdog."""
        self.advance(now_ns)
        self._watchdog.hear(self.now_ns)

    def _truth(self) -> dict[str, Any]:
        stored = self.plc.memory.defined()
        return {
            **self.world.truth(),
            "stored": {
                str(number): asdict(self._offset(slot.tool)) for number, slot in stored.items()
            },
            "selected_tool": self.plc.tools.selected,
        }

    def _offset(self, tool: Six) -> ToolOffset:
        """Return what a slot means in mm and U, V, W, however the driver converts it."""
        mm = self.options.mailbox.unit_um / 1000
        frame = CoordRef(*tool).frame()
        x, y, z = frame.shift_mm
        angles = (round(angle, 9) + 0.0 for angle in zyx_angles(frame.rotation))
        return ToolOffset(x * mm, y * mm, z * mm, *angles)

    def _renew(self) -> None:
        self.faults.forget()
        starts, cuts = self.plc.starts, self.plc.cuts
        self._make()
        self.plc.starts += starts  # hosts cut their links when this number changes
        self.plc.cuts = cuts

    def _moment(self) -> dict[str, Any]:
        return {
            "memory": deepcopy(self.plc.memory.to_state()),
            "selected": self.plc.tools.selected,
            "axes": self.plc.group.values,
            "world": self.world.moment(),
        }

    def _restore(self, held: Mapping[str, Any]) -> None:
        self.plc.memory.restore(held["memory"])
        self.plc.group.place(held["axes"])
        self.plc.tools.preselect(held["selected"])
        self.world.put_back(held["world"])
        self._file.save_changes()

    def _after_act(self) -> None:
        self._file.save_changes()

    def _make_ready(self) -> None:
        x_mm, y_mm, z_mm, *_ = self.world.stored.components()
        self.plc.make_ready(CoordRef(x_mm, y_mm, z_mm))

    def _serve(
        self,
        shown: str,
        now_ns: int,
        link: LinkKind,
        carry_out: Callable[[Sequence[PlcFault]], Words],
    ) -> ServedAccess:
        self.hear(now_ns)
        self._requests += 1
        number = self._requests
        self.log.add(self.now_ns, ">", shown)
        faults = self.faults.take(shown, link)
        refused = False
        if faults:
            actions = {fault.action for fault in faults}
            if PlcFaultAction.DISCONNECT_BEFORE in actions:
                return ServedAccess(answered=False, cut=True)
            if PlcFaultAction.DROP_REQUEST in actions:
                return ServedAccess(answered=False)
            refused = is_refused(shown, actions)
        self._mishaps.strike(faults, self.now_ns)
        try:
            if self.on_request is not None:
                self.on_request(number, shown)
        finally:
            words = () if refused else carry_out(faults)
            self._file.save_changes()
        self.exchanges += 1
        self.log.add(self.now_ns, "<", shown)
        if self.on_reply is not None:
            self.on_reply(number, shown)
        return self.faults.leaving(shown, words, faults, after_s=self.answer_s)

    def _take(self, first: int, words: Sequence[int], faults: Sequence[PlcFault]) -> Words:
        words = self.faults.arriving(words, faults)
        if not faults:
            self._store(first, words)
            return ()
        planned = {fault.action: fault for fault in faults}
        if PlcFaultAction.IGNORE_WRITE in planned:
            return ()
        if PlcFaultAction.REORDER_WRITE in planned:
            self._overtaken.append((first, words))
            return ()
        stall = planned.get(PlcFaultAction.STALL)
        if stall is not None:
            self._mishaps.plan(self.now_ns, stall.seconds, lambda: self._store(first, words))
            return ()
        again = planned.get(PlcFaultAction.DUPLICATE_REQUEST)
        if again is not None:
            self._mishaps.plan(self.now_ns, again.seconds, lambda: self._store(first, words))
        torn = planned.get(PlcFaultAction.TEAR_WRITE)
        if torn is not None:
            self._tear(first, words, torn)
            return ()
        self._store(first, words)
        return ()

    def _tear(self, first: int, words: Words, torn: PlcFault) -> None:
        """Store the first words, and the rest later."""
        middle = len(words) // 2 if torn.position is None else torn.position % len(words)
        late = words[middle:]
        late_s = torn.seconds or _TORN_S
        self._mishaps.plan(self.now_ns, late_s, lambda: self._store(first + middle, late))
        self._store(first, words[:middle])

    def _store(self, first: int, words: Words) -> None:
        overtaken, self._overtaken = self._overtaken, []
        for start, piece in ((first, words), *overtaken):
            self.plc.write(start, piece, self.now_ns)

    def _step(self, now_ns: int) -> None:
        self.now_ns = now_ns
        self._stepping = True
        try:
            self.plc.advance(now_ns)
            self._mishaps.carry_out(now_ns)
            if self._watchdog.expires(now_ns):
                self.plc.program.zero_inputs(now_ns)
            self._file.save_changes()
        finally:
            self._stepping = False


def _opcode_name(words: Sequence[int]) -> str:
    place = COMMAND["opcode"].word
    if len(words) <= place:
        return ""
    try:
        return Opcode(words[place]).name
    except ValueError:
        return str(words[place])
