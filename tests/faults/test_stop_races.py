"""`stop()` from a second thread at random moments, in real time, to find what placements missed.

Before there was a latch, 208 of 400 such stops were acknowledged and the movement in preparation
still left. The moments are drawn over the time that a start of a movement takes here.
"""

import os
import random
import signal
import threading
import time
from dataclasses import replace

import pytest
from robolink_simulators.epson.device import EpsonSimulator

from robolink import interrupts
from robolink.errors import StoppedError
from robolink.model import MotionProfile, Path, WorkBox
from tests._patience import PATIENCE_S
from tests.contract import _softmotion_cell as plcs
from tests.contract.conftest import served

ANYWHERE = WorkBox()
STEP = MotionProfile(Path.STRAIGHT, 5, 50.0)
STEP_MM = 0.5
_HEARTBEAT_WORD = 62


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


def move(group, dz_mm):
    here = group.pose()
    return group.move_to(replace(here, z_mm=here.z_mm + dz_mm), STEP, box=ANYWHERE)


class Stopper(threading.Thread):
    """Stops after a delay; ``acknowledged`` is the number of movements begun by then."""

    def __init__(self, controller, moves_begun, delay_s):
        super().__init__()
        self._controller, self._moves_begun, self._delay_s = controller, moves_begun, delay_s
        self.acknowledged: int | None = None

    def run(self):
        time.sleep(self._delay_s)
        self._controller.stop()
        self.acknowledged = self._moves_begun()


def races(controller, moves_begun, trials, *, reset):
    """Stop prepared movements; return how many had left, and how many began all the same."""
    group = controller.groups[0]
    begun = time.perf_counter()
    move(group, STEP_MM).wait(timeout_s=20)
    lasts_s = time.perf_counter() - begun
    rng = random.Random(1)
    left = after = 0
    for trial in range(trials):
        stopper = Stopper(controller, moves_begun, rng.uniform(0, lasts_s))
        before = moves_begun()
        stopper.start()
        try:
            motion = move(group, STEP_MM if trial % 2 else -STEP_MM)
            motion.wait(timeout_s=20)
        except StoppedError:
            pass
        stopper.join(PATIENCE_S)
        assert stopper.acknowledged is not None, "no stop was acknowledged"
        left += stopper.acknowledged > before
        after += moves_begun() > stopper.acknowledged
        if reset:
            controller.reset_fault()
        controller.release_stop()
        assert controller.outcomes.open_markers() == ()
    print(f"{trials} stops, {left} movements had left before, {after} began after")  # noqa: T201
    return left, after


@pytest.mark.parametrize("trials", [20, pytest.param(400, marks=pytest.mark.soak)])
def test_no_movement_begins_after_an_acknowledged_stop_on_epson(trials):
    simulator = EpsonSimulator(seed=7)
    with served("tcp", simulator) as cell, cell.connect() as controller:
        controller.motors(True)
        _, after = races(
            controller, lambda: simulator.machine.arm.moves_started, trials, reset=False
        )
    assert after == 0


@pytest.mark.parametrize("trials", [10, pytest.param(400, marks=pytest.mark.soak)])
def test_no_movement_begins_after_an_acknowledged_stop_on_a_plc(trials):
    with plcs.served("modbus-tcp") as cell, cell.connect() as controller:
        _, after = races(
            controller, lambda: cell.simulator.plc.group.movements_started, trials, reset=True
        )
    assert after == 0


def stop_beside(controller):
    """Stop in another thread; returns once nothing may leave any more."""
    threading.Thread(target=controller.stop).start()
    come_true(lambda: controller.latch.closed)


def press_ctrl_c(_controller):
    """Interrupt the main thread; returns once it has heard that inside of its exchange."""
    os.kill(os.getpid(), signal.SIGINT)
    come_true(lambda: interrupts._handler.held)


def come_true(what):
    deadline = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.001)


@pytest.mark.parametrize(
    ("end", "error"), [(stop_beside, StoppedError), (press_ctrl_c, KeyboardInterrupt)]
)
@pytest.mark.usefixtures("signals_of_a_terminal")
def test_between_the_beat_and_its_command_over_opc_ua_a_movement_is_still_held_back(
    monkeypatch, end, error
):
    """The PLC has got the beat and not answered it, so the command has not left yet."""
    with plcs.served("opcua") as cell, cell.connect() as controller:
        group = controller.groups[0]
        move(group, STEP_MM).wait(timeout_s=20)
        write = cell.simulator.write
        ended: list[object] = []

        def meet(start, words, *more):
            if start == _HEARTBEAT_WORD and cell.open_requests and not ended:
                ended.append(words)
                end(controller)
            return write(start, words, *more)

        before, moved = len(cell.commands), cell.movements_started
        monkeypatch.setattr(cell.simulator, "write", meet)
        with pytest.raises(error):
            move(group, STEP_MM)
        assert ended, "no beat came before the command"
        controller.stop()
        assert set(cell.commands[before:]) <= {"STOP", "HALT"}
        assert cell.movements_started == moved
        assert cell.open_requests == []
        controller.release_stop()
        controller.reset_fault()
        move(group, STEP_MM).wait(timeout_s=20)
        assert cell.movements_started == moved + 1
