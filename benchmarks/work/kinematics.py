"""Inverse kinematics of a simulated six-axis arm: poses a second, one core."""

import random
from collections.abc import Iterator
from statistics import median
from time import perf_counter

from robolink_simulators.epson.arm.kinematics import forward, hand_of, inverse
from robolink_simulators.epson.arm.robots import Joints, find_robot

from benchmarks.table import Amount, Figure

POSES = 5_000
ROUNDS = 5
WANTED_PER_S = 20_000
"""Poses per second with which a 1 m line is checked every 0.05 mm within a second."""


def measure_kinematics() -> Iterator[Figure]:
    """Yield how many poses a second are turned into joints, ranges looked at."""
    model, rng = find_robot("C8-C901S"), random.Random(1)
    joints = [Joints(*(rng.uniform(low, high) for low, high in model.ranges)) for _ in range(POSES)]
    poses = [(forward(model, one), hand_of(model, one)) for one in joints]
    rates = []
    for _ in range(ROUNDS):
        began = perf_counter()
        for pose, hand in poses:
            inverse(model, pose, hand, pose.posture)
        rates.append(POSES / (perf_counter() - began))
    rate = median(rates)
    yield Figure(
        "inverse kinematics of six axes",
        Amount(rate, "/s"),
        "wanted",
        Amount(WANTED_PER_S, "/s"),
        WANTED_PER_S / rate,
        1.0,
    )
