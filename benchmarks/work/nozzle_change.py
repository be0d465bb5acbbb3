"""A whole simulated two-pose nozzle change on ``sim://``: wall time, time-warp factor, requests.

And how long the shipped recipe for a needle on two light beams takes in simulated time.
"""

from collections.abc import Iterator
from dataclasses import replace
from statistics import median
from time import perf_counter_ns

from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.hosting.in_process.epson import simulator_named, unregister

import robolink
from benchmarks.table import Amount, Figure
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.model import MotionProfile, Path, WorkBox
from tests.contract.robot_time import measured

ROUNDS = 9
WANTED = {"a movement": 5.0, "a whole change": 170.0}
"""Requests: of a movement its proof, itself, the looks at the flags, and the position after it."""
WAY_MM = 20.0
WHAT = {
    0: "two-pose nozzle change on sim://",
    20: "the same, of a controller that answers after 20 ms",
}
"""What is measured, by the answer time in milliseconds."""

NEEDLE, PLC_NEEDLE = "needle-beams", "needle-beams on a PLC"
NEEDLE_WANTED_S = {0: 10.0, 20: 20.0}
"""Most seconds wanted, by the answer time in milliseconds."""
REQUESTS_WANTED = {NEEDLE: 450, PLC_NEEDLE: 450}
"""Most requests wanted, with answers after 20 ms."""
PLC_KB_WANTED = 80.0
"""Most kilobytes wanted of a mailbox, requests and answers without the frames of a network."""


def measure_nozzle_change() -> Iterator[Figure]:
    """Yield wall milliseconds, simulated seconds and their ratio, by how fast answers come."""
    for answer_ms, what in WHAT.items():
        runs = [_change(seed, answer_ms) for seed in range(ROUNDS + 1)][1:]
        wall_s = median(wall for wall, _, _ in runs)
        simulated_s = median(simulated for _, simulated, _ in runs)
        yield Figure(
            what,
            Amount(wall_s * 1000, "ms"),
            "its simulated time",
            Amount(simulated_s * 1000, "ms"),
            wall_s / simulated_s,
        )
    asked = {"a movement": _movement(), "a whole change": median(each for _, _, each in runs)}
    for what, requests in asked.items():
        yield Figure(
            f"requests of {what}",
            Amount(requests, ""),
            "wanted",
            Amount(WANTED[what], ""),
            requests / WANTED[what],
            1.0,
        )
    yield from measured_needle()
    yield from measured_needle(PLC_NEEDLE)


def measured_needle(name: str = NEEDLE) -> Iterator[Figure]:
    """Yield simulated seconds and requests of a needle that is changed and measured on its beams.

    Turn test and all; its simulated time does not depend on the machine, so each is measured once.

    Args:
        name: Of its cell. That of a PLC yields its kilobytes, too.
    """
    for answer_ms, wanted_s in NEEDLE_WANTED_S.items():
        took = measured(name, answer_ms)
        what = f"{name}, simulated time"
        what += f", answers after {answer_ms} ms" if answer_ms else ""
        yield _wanted(what, took.took_s, "s", wanted_s)
    yield _wanted(f"requests of {name}", took.exchanges, "", REQUESTS_WANTED[name])
    if name == PLC_NEEDLE:
        yield _wanted(f"traffic of {name}", took.traffic_bytes / 1000, "kB", PLC_KB_WANTED)


def _wanted(what: str, found: float, unit: str, most: float) -> Figure:
    return Figure(what, Amount(found, unit), "wanted", Amount(most, unit), found / most, 1.0)


def _movement() -> int:
    """Return how many requests a straight movement takes, the second of its speed."""
    with robolink.connect("epson+sim://bench-movement?seed=1") as controller:
        controller.motors(True)
        group = controller.groups[0]
        asked = 0
        for _ in range(2):
            asked = controller.exchanges
            here = group.pose()
            target = replace(here, z_mm=here.z_mm + WAY_MM)
            group.move_to(target, MotionProfile(Path.STRAIGHT), box=WorkBox()).wait(timeout_s=60)
        requests = controller.exchanges - asked
    unregister("bench-movement")
    return requests


def _change(seed: int, answer_ms: int) -> tuple[float, float, int]:
    name = f"bench-{seed}"
    url = f"epson+sim://{name}?seed={seed}&answer_ms={answer_ms}"
    with robolink.connect(url) as controller:
        eyes = InProcessEyes(simulator_named(name))
        controller.motors(True)
        asked = controller.exchanges
        simulated_ns = controller.clock.now_ns()
        start = perf_counter_ns()
        NozzleChange(
            controller,
            ChangePlan((ToolPlan(1),), ask_before_write=False),
            operator=AssistedOperator.with_eyes(eyes, lambda _: None, clock=controller.clock),
        ).run()
        wall_ns = perf_counter_ns() - start
        simulated_ns = controller.clock.now_ns() - simulated_ns
        requests = controller.exchanges - asked
    unregister(name)
    return wall_ns / 1e9, simulated_ns / 1e9, requests
