"""A whole simulated two-pose nozzle change on ``sim://``: wall time and time-warp factor."""

from collections.abc import Iterator
from statistics import median
from time import perf_counter_ns

from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.hosting.in_process.epson import simulator_named, unregister

import robolink
from benchmarks.table import Amount, Figure
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan

ROUNDS = 9
WHAT = {
    0: "two-pose nozzle change on sim://",
    20: "the same, of a controller that answers after 20 ms",
}
"""What is measured, by the answer time in milliseconds."""


def measure_nozzle_change() -> Iterator[Figure]:
    """Yield wall milliseconds, simulated seconds and their ratio, by how fast answers come."""
    for answer_ms, what in WHAT.items():
        runs = [_change(seed, answer_ms) for seed in range(ROUNDS + 1)][1:]
        wall_s = median(wall for wall, _ in runs)
        simulated_s = median(simulated for _, simulated in runs)
        yield Figure(
            what,
            Amount(wall_s * 1000, "ms"),
            "its simulated time",
            Amount(simulated_s * 1000, "ms"),
            wall_s / simulated_s,
        )


def _change(seed: int, answer_ms: int) -> tuple[float, float]:
    name = f"bench-{seed}"
    url = f"epson+sim://{name}?seed={seed}&answer_ms={answer_ms}"
    with robolink.connect(url) as controller:
        eyes = InProcessEyes(simulator_named(name))
        controller.motors(True)
        simulated_ns = controller.clock.now_ns()
        start = perf_counter_ns()
        NozzleChange(
            controller,
            ChangePlan((ToolPlan(1),), ask_before_write=False),
            operator=AssistedOperator.with_eyes(eyes, lambda _: None, clock=controller.clock),
        ).run()
        wall_ns = perf_counter_ns() - start
        simulated_ns = controller.clock.now_ns() - simulated_ns
    unregister(name)
    return wall_ns / 1e9, simulated_ns / 1e9
