"""A client that knows only the mailbox's codec, not the driver, on any link."""

from dataclasses import replace

from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.in_process.mailbox_link import InProcessMailboxLink
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import (
    Command,
    CommandState,
    CoordinateSystem,
    Finished,
    Opcode,
    Response,
    Slot,
    decode_response,
    decode_slot,
    encode_command,
    heartbeat_word,
    next_number,
)

NO_TOOL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LINE = (100.0, 1000.0, 1000.0, 10000.0)
FACTORS = (0.5, 0.5, 0.5, 0.5)
MCS, ACS = CoordinateSystem.MCS, CoordinateSystem.ACS


class MailboxClient:
    """Sends commands one at a time and reads the responses."""

    def __init__(self, link, owner=0xC0FFEE):
        self.link = link
        self.owner = owner
        self.epoch = 0
        self.sequence = self.now().ack_head
        self.beats = 0

    def now(self) -> Response:
        """Read a whole response block."""
        return decode_response(self.link.read_response())

    def slot(self, number) -> Slot:
        """Read a tool slot."""
        return decode_slot(self.link.read_slot(number))

    def command(self, opcode, *operands, **fields) -> Command:
        """Make the next command."""
        self.sequence = next_number(self.sequence)
        padded = (*operands, *(0,) * (4 - len(operands)))
        command = Command(
            self.sequence, opcode, operands=padded, owner=self.owner, epoch=self.epoch
        )
        return replace(command, **fields)

    def write(self, command):
        """Write a command with a fresh heartbeat."""
        self.beats += 1
        self.link.write_command(
            encode_command(command, heartbeat=heartbeat_word(self.epoch, self.beats))
        )

    def tell(self, opcode, *operands, **fields) -> Response:
        """Send a command and return the snapshot that acknowledges it."""
        command = self.command(opcode, *operands, **fields)
        self.write(command)
        return self.acknowledged(command)

    def acknowledged(self, command) -> Response:
        """Return the snapshot that acknowledges a command."""
        for _ in range(200):
            now = self.now()
            if (now.ack_head, now.ack_owner) == (command.sequence, command.owner):
                return now
            self.link.clock.sleep(0.005)
        raise AssertionError(f"not acknowledged: {command}")

    def done(self, opcode, *operands, **fields) -> Response:
        """Send a command and return the snapshot that shows it done."""
        now = self.settled(self.tell(opcode, *operands, **fields))
        assert (now.state, now.error_class) == (CommandState.DONE, 0), now
        return now

    def refused(self, opcode, *operands, **fields) -> int:
        """Send a command that ends in error and return its error class."""
        now = self.settled(self.tell(opcode, *operands, **fields))
        assert now.state == CommandState.ERROR, now
        return now.error_class

    def settled(self, now: Response) -> Response:
        """Return the snapshot that shows the end of the command acknowledged in ``now``."""
        for _ in range(2000):
            if CommandState(now.state).final:
                break
            self.wait(0.01)
            now = self.now()
        return now

    def after_a_cycle(self) -> Response:
        """Return the snapshot after the mailbox program has read the machine again."""
        self.wait(0.01)
        return self.now()

    def take(self, *, insist=0) -> Response:
        """Take the mailbox."""
        now = self.done(Opcode.OWNERSHIP, 1, insist)
        self.epoch = now.answer.epoch
        return now

    def beat(self):
        """Send a heartbeat alone."""
        self.beats += 1
        self.link.beat(heartbeat_word(self.epoch, self.beats))

    def wait(self, seconds):
        """Let time pass, with heartbeats."""
        while seconds > 0:
            self.beat()
            self.link.clock.sleep(min(seconds, 0.1))
            seconds -= 0.1

    def move(self, x=0.0, y=0.0, z=0.0, *, mode=0, dynamics=LINE, **fields) -> Response:
        """Command a straight move to a place beside the present TCP."""
        pose = shifted(self.now().tcp, x, y, z)
        operands = (0, 0, MCS, mode)
        return self.tell(Opcode.MOVE_LINEAR, *operands, pose=pose, dynamics=dynamics, **fields)

    def end_of(self, sequence) -> Finished:
        """Wait until a movement has ended and return its end."""
        for _ in range(1000):
            for end in self.now().finished:
                if end.sequence == sequence:
                    return end
            self.wait(0.02)
        raise AssertionError(f"movement {sequence} does not end")


def shifted(pose, x=0.0, y=0.0, z=0.0):
    """Return a pose beside another one."""
    return (pose[0] + x, pose[1] + y, pose[2] + z, *pose[3:])


def linked(simulator, owner=0xC0FFEE) -> MailboxClient:
    """Connect a client to a simulator of this process, on a stopped clock."""
    clock = ManualClock(simulator.now_ns)
    simulator.present_ns = clock.now_ns
    return MailboxClient(InProcessMailboxLink("sim", simulator, clock, 3.0), owner)


def another(client, owner=0xBADCAFE) -> MailboxClient:
    """Connect a second client to the same simulator."""
    link = client.link
    return MailboxClient(InProcessMailboxLink("sim", link._simulator, link.clock, 3.0), owner)


def owning(simulator=None, **arguments) -> tuple[MailboxClient, SoftMotionSimulator]:
    """Return a client that owns the mailbox, and the simulator behind it."""
    simulator = simulator or SoftMotionSimulator(**arguments)
    client = linked(simulator)
    client.take()
    return client, simulator
