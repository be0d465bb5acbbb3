"""A movement on a serial line, and the exchanges between its heartbeats.

Line and PLC run at half speed here, so that a busy machine does not decide the outcome.
"""

import threading
from contextlib import ExitStack, contextmanager

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_rtu
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.controllers import Jog
from robolink.errors import ConfigError
from robolink.journal import memory_journal
from robolink.model import MotionOutcome, MotionProfile, Path, ToolOffset, WorkBox
from tests.contract._softmotion_cell import above

PACE = 0.5
LONG = ("read_response", "read_slot")
"""Exchanges that take a large part of the half second for which the PLC waits for a heartbeat."""


@contextmanager
def line_at(baud, *, carried=True):
    """Serve a PLC on a line; a link that is not slowed down is slow only for the driver."""
    with ExitStack() as stack:
        simulator = SoftMotionSimulator(seed=7)
        rate, pace = (round(PACE * baud), PACE) if carried else (0, 1.0)
        host = serve_modbus_rtu(simulator, baud=rate, clock=ScaledClock(pace))
        stack.enter_context(host)
        # The driver uses the rate in the URL: that of the line at full speed.
        url = host.url.replace(f"baud={rate or 115200}", f"baud={baud}")
        log = memory_journal("slow line").log(url)
        yield simulator, stack.enter_context(robolink.connect(url, outcomes=log))


class Watch:
    """The exchanges between heartbeats during a movement or a jog.

    Attributes:
        gaps: The exchanges between one heartbeat and the next; the last gap is at the end.
    """

    def __init__(self, simulator):
        self._jobs = simulator.plc.program.jobs
        self._jogging = False
        self.gaps: list[list[str]] = []
        simulator.on_request = self._note

    def _note(self, _number, text):
        kind = text.partition(" ")[0]
        if kind == "write_command":
            self._jogging = "JOG" in text and not self._jogging
        if not (self._jobs.movements or self._jogging or text.startswith("write_command MOVE")):
            return
        if kind in ("write_command", "beat"):
            self.gaps.append([])
        else:
            self.gaps[-1].append(kind)

    def require_beats_around_long_ones(self):
        """Check that each long exchange comes just after a heartbeat, and no two without one."""
        assert len(self.gaps) > 5
        for gap in self.gaps:
            assert not [kind for kind in gap[1:] if kind in LONG], gap

    @property
    def long_ones(self):
        return [kind for gap in self.gaps for kind in gap if kind in LONG]


@pytest.mark.parametrize("baud", [9600, pytest.param(19200, marks=pytest.mark.soak)])
def test_one_whole_look_at_the_beginning_then_the_head_alone(baud):
    with line_at(baud, carried=False) as (simulator, controller):
        group, watch = controller.groups[0], Watch(simulator)
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=2.0)
        motion = group.move_to(above(group.pose(), 2.0), profile, box=WorkBox())
        assert motion.wait(timeout_s=20) is MotionOutcome.ARRIVED
    watch.require_beats_around_long_ones()
    # One shows the acceptance; another comes only after more than ten times its own time.
    assert 1 <= len(watch.long_ones) <= 3


def test_a_jog_has_a_beat_before_each_whole_look():
    with line_at(9600, carried=False) as (simulator, controller):
        watch = Watch(simulator)
        jog = Jog(forward=frozenset({2}), speed_mm_s=2.0)
        controller.groups[0].jog(jog, duration_s=1.0, box=WorkBox())
    watch.require_beats_around_long_ones()


def test_another_thread_that_reads_all_the_time_lets_every_beat_through():
    with line_at(9600) as (simulator, controller):
        group, watch = controller.groups[0], Watch(simulator)
        over = threading.Event()
        reads: list[object] = []

        def read_on():
            while not over.is_set():
                reads.extend((controller.tools.read(1), controller.status()))

        target = above(group.pose(), 3.0)
        reader = threading.Thread(target=read_on)
        profile = MotionProfile(Path.STRAIGHT, speed_mm_s=2.0)
        motion = group.move_to(target, profile, box=WorkBox())
        reader.start()
        try:
            assert motion.wait(timeout_s=20) is MotionOutcome.ARRIVED
        finally:
            over.set()
            reader.join()
        assert len(reads) > 2
        assert simulator.plc.group.movements_started == 1
    watch.require_beats_around_long_ones()


@pytest.mark.parametrize("baud", [1200, pytest.param(2400, marks=pytest.mark.soak), 4800])
def test_a_line_that_is_too_slow_to_beat_moves_nothing_and_says_so(baud):
    with line_at(baud, carried=False) as (simulator, controller):
        group = controller.groups[0]
        jog = Jog(forward=frozenset({2}), speed_mm_s=2.0)
        for act in (
            lambda: group.move_to(above(group.pose(), 3.0), MotionProfile(), box=WorkBox()),
            lambda: group.jog(jog, duration_s=1.0, box=WorkBox()),
            lambda: group.require_able("the test"),
            group.resume,
        ):
            with pytest.raises(ConfigError, match="too slow to move") as caught:
                act()
            assert "9600" in caught.value.remedy
        assert controller.outcomes.open_markers() == ()
        assert not [text for _, _, text in simulator.log if text.startswith("write_command")]
        # Its tools are as good as those of any other line.
        controller.tools.write(7, ToolOffset(1.5), expected=controller.tools.read(7))
