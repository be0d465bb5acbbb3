"""A full disk, a locked record, a clock that jumps, a computer that sleeps.

Rows F61, F63, F64 and F65 of the catalogue: a real small file system, a real other process, real
SIGSTOP and SIGCONT.
"""

import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from robolink_cli.console.exit_codes import USAGE
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import runtime
from robolink.errors import LeaseHeldError, LeaseLostError, TransportTimeoutError
from robolink.journal import open_journal
from robolink.journal.store import connection
from robolink.model import Marker, MarkerKind
from tests._patience import PATIENCE_S
from tests.faults._client_process import ClientProcess
from tests.faults._nozzle_cell import OLD_TIP, NozzleCell, served_cell
from tests.faults._requests import changes

ROOT = Path(__file__).parents[2]


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NozzleCell]:
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        yield cell


def await_that(condition: Callable[[], bool], process: ClientProcess) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, process.err
        time.sleep(0.005)


# ---- F61

ON_A_SMALL_DISK = """
mount -t tmpfs -o size=1m none {disk} || exit 99
{python} -m robolink_cli -c {url} tool set 2 --x 1 --yes || exit 98
head -c 2M /dev/zero > {disk}/other 2>/dev/null
exec {python} -m robolink_cli -c {url} tool set 1 --x 12.5 --yes
"""


@pytest.mark.soak
@pytest.mark.fault("F61")
def test_f61_on_a_disk_that_is_full_nothing_is_written(cell, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    script = ON_A_SMALL_DISK.format(disk=disk, python=sys.executable, url=cell.url)
    if shutil.which("unshare") is None:
        pytest.skip("there is no unshare here, to mount a small file system")
    ended = subprocess.run(
        ["unshare", "--mount", "--map-root-user", "sh", "-c", script],
        cwd=ROOT,
        env={**os.environ, "ROBOLINK_JOURNAL": str(disk / "journal.db")},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    if ended.returncode == 99 or "unshare:" in ended.stderr:
        pytest.skip(f"no small file system can be mounted here: {ended.stderr.strip()}")
    assert ended.returncode == USAGE, ended.stderr
    assert "the disk" in ended.stderr
    assert str(disk / "journal.db") in ended.stderr
    written = changes(cell.requests)
    assert len([text for text in written if "TLSet" in text]) == 1  # that of tool 2
    assert cell.tool_1 == OLD_TIP


# ---- F63

HOLD = """
import sqlite3, sys
held = sqlite3.connect(sys.argv[1], isolation_level=None)
held.execute("BEGIN IMMEDIATE")
print("held", flush=True)
sys.stdin.read()
"""


@pytest.mark.fault("F63")
def test_f63_a_record_that_another_process_keeps_locked_is_waited_for_and_then_refused(
    cell, monkeypatch
):
    monkeypatch.setattr(connection, "BUSY_S", 0.3)
    assert cell.run("tool", "set", "2", "--x", "1", "--yes").code == 0
    path = cell.state_folder / "journal.db"
    command = [sys.executable, "-c", HOLD, str(path)]
    asked = len(cell.requests)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"held\n"
        began_s = time.monotonic()
        refused = cell.run("tool", "set", "1", "--x", "12.5", "--yes")
        assert time.monotonic() - began_s > 0.3
        assert refused.code == USAGE
        assert "another program keeps it locked" in refused.err
        assert changes(cell.requests[asked:]) == []
        assert cell.run("status").code == 0  # reading goes on
        other.communicate()
    assert cell.run("tool", "set", "1", "--x", "12.5", "--yes").code == 0


# ---- F64


class Jumping(runtime.SystemRuntime):
    """Wall time that is another day at each reading, forth and back."""

    def __init__(self) -> None:
        self._days = itertools.cycle((0, 400, -3000, 1, -1, 20_000))
        self.asked = 0

    def wall_s(self) -> float:
        self.asked += 1
        return super().wall_s() + 86_400 * next(self._days)


@pytest.mark.fault("F64")
def test_f64_a_clock_that_jumps_changes_neither_deadlines_nor_the_order_of_the_record(cell):
    jumping = Jumping()
    with runtime.replaced(jumping):
        for x_mm in ("12.5", "12.25", "12.75"):
            done = cell.run("tool", "set", "1", "--x", x_mm, "--yes")
            assert done.code == 0, done.err
        assert cell.tool_1.x_mm == 12.75
        undone = cell.run("undo", "--yes")  # of the last one, not of the latest date
        assert undone.code == 0, undone.err
        assert cell.tool_1.x_mm == 12.25
        assert cell.run("journal", "verify").code == 0
    assert jumping.asked > 10
    numbers = [entry.number for entry in open_journal().entries(newest_first=False)]
    assert numbers == sorted(numbers)
    dates = [entry.at for entry in open_journal().entries(newest_first=False)]
    assert dates != sorted(dates), "the clock did not jump"


@pytest.mark.fault("F64")
def test_f64_a_time_out_lasts_as_long_as_it_is_whatever_the_clock_says(tmp_path):
    simulator = EpsonSimulator(seed=2)
    with runtime.replaced(Jumping()), serve_tcp(simulator) as host:
        journal = open_journal(str(tmp_path / "journal.db"))
        mine, other = (journal.log(host.url) for _ in range(2))
        with robolink.connect(host.url, outcomes=mine, timeout_s=1.0) as controller:
            marker = controller.begin(MarkerKind.CHANGE, "a change", {})
            for _ in range(5):
                with pytest.raises(LeaseHeldError):  # the lease has not expired, and never will
                    other.look()
            controller.finish(marker)
            simulator.on_request = lambda _number, _text: time.sleep(1.5)
            began_s = time.monotonic()
            with pytest.raises(TransportTimeoutError):
                controller.status()
            assert 0.9 < time.monotonic() - began_s < 10.0
            simulator.on_request = None
        journal.close()


# ---- F65


@contextmanager
def frozen(process: ClientProcess) -> Iterator[None]:
    process.signal(signal.SIGSTOP)
    try:
        yield
    finally:
        process.signal(signal.SIGCONT)


@pytest.fixture
def beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., ClientProcess]:
    """Start a command in a separate process."""
    state = str(tmp_path / "state")
    monkeypatch.setenv("ROBOLINK_STATE_DIR", state)

    def started(*arguments: str) -> ClientProcess:
        return ClientProcess(arguments, environment={"ROBOLINK_STATE_DIR": state}, folder=tmp_path)

    return started


@pytest.mark.fault("F65")
def test_f65_a_computer_that_slept_in_a_movement_calls_it_unproved_and_moves_nothing_more(beside):
    """It sleeps for longer than the controller waits for a sign of life (3 s)."""
    simulator = EpsonSimulator(seed=4, options=EpsonOptions(remote_timeout_s=3.0))
    simulator.machine.switch_motors(True)
    arm = simulator.machine.arm
    with serve_tcp(simulator) as host:
        process = beside("-c", host.url, "jog", "x-5", "--speed", "1", "--yes")
        await_that(lambda: arm.moving, process)
        with frozen(process):
            await_that(lambda: simulator.condition.code == 19, process)
            await_that(lambda: not arm.moving, process)
        assert process.exit_code() == 6
        assert "may or may not have run" in process.err
        assert arm.moves_started == 1
        simulator.condition.reset()
        with robolink.connect(host.url) as controller:
            with pytest.raises(robolink.errors.OutcomeUnknownError, match="did not finish"):
                controller.require_settled("a movement")


def at_rest(simulator: SoftMotionSimulator) -> bool:
    with simulator.acting():
        return simulator.plc.group.motion.resting


@pytest.mark.fault("F65")
def test_f65_a_plc_halts_when_the_computer_sleeps_and_nothing_goes_on_when_it_wakes(beside):
    simulator = SoftMotionSimulator(seed=4)
    group = simulator.plc.group
    with serve_modbus_tcp(simulator, clock=ScaledClock(1.0)) as host:
        process = beside("-c", host.url, "jog", "x-5", "--speed", "1", "--yes")
        await_that(lambda: group.movements_started > 0, process)
        began_mm = group.tcp().shift_mm[0]
        with frozen(process):
            await_that(lambda: at_rest(simulator), process)
        assert process.exit_code() not in (0, 70)
        assert "701" in process.err
        assert group.movements_started == 1
        assert at_rest(simulator)
        assert began_mm - group.tcp().shift_mm[0] < 3


ASLEEP_S = 3600
SOMEBODY_ELSE = """
import sys
from robolink.errors import LeaseHeldError
from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind
log = open_journal(sys.argv[1]).log(sys.argv[2])
try:
    log.begin(Marker("theirs", MarkerKind.SET, "TLSet 3", "now", {"tool": 3}))
    log.clear("theirs")
except LeaseHeldError:
    print("held")
else:
    print("taken")
"""


def said_after_sleep(location: Path, identity: str, asleep_s: int) -> str:
    """Let another process ask for a lease on this computer, which has slept meanwhile.

    Only the clock that counts the time asleep is shifted, as by a suspend (time_namespaces(7)).
    """
    if shutil.which("unshare") is None:
        pytest.skip("there is no unshare here, to shift the clock that counts the time asleep")
    asleep = ["unshare", "--time", "--boottime", str(asleep_s)]
    command = [sys.executable, "-c", SOMEBODY_ELSE, str(location), identity]
    ended = subprocess.run(
        [*asleep, *command], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    if "unshare:" in ended.stderr:
        pytest.skip(f"no time namespace can be made here: {ended.stderr.strip()}")
    assert not ended.returncode, ended.stderr
    return ended.stdout.strip()


@pytest.mark.soak
@pytest.mark.fault("F65")
def test_f65_who_slept_has_lost_the_lease_and_begins_nothing_more(tmp_path):
    """The process with the lease lives, and lost it by the time asleep alone."""
    location, identity = tmp_path / "journal.db", "epson+tcp://192.168.0.1:5000"
    with closing(open_journal(str(location))) as journal:
        log = journal.log(identity)
        log.begin(Marker("ours", MarkerKind.SET, "TLSet 2", "now", {"tool": 2}))
        assert said_after_sleep(location, identity, 0) == "held"
        assert said_after_sleep(location, identity, ASLEEP_S) == "taken"
        with pytest.raises(LeaseLostError):
            log.begin(Marker("more", MarkerKind.SET, "TLSet 2", "now", {"tool": 2}))
