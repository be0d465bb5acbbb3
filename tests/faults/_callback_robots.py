"""Two robots on one controller whose programs call back: a SCARA that turns, six axes that tilt."""

from dataclasses import replace

import numpy as np
from robolink_simulators.cell.workplace import exchanged
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.world import STORED_ON_SIX_AXES

from robolink.calibration import rotation_of, uvw_deg
from tests.faults._callback_cell import CONTACT, CallbackCell, touching

TILTS = ((0, 0), (18, 0), (18, 90), (18, 180), (18, -90), (9, 45))
"""The tilts of the measurement: angle, and direction in the base."""

PROVING_TILTS = ((22, 135), (22, -45), (22, 20))


def two_programs():
    """Return ``main`` for robot 1 and ``main3`` for robot 2, each with its own contact."""
    first = touching("n-angle").replace("Function main\n", "Function main\n  Robot 1\n")
    second = touching("pivot", TILTS, PROVING_TILTS)
    begin, end = second.index("Function main\n"), second.index("Function main2")
    second = second[begin:end].replace("Function main\n", "Function main3\n  Robot 2\n")
    text = first + second
    return text.replace(f"({CONTACT})", f"({CONTACT - 1} + Robot)")


class TwoRobotCell(CallbackCell):
    """Robot 1 and robot 2; properties refer to the robot selected last."""

    robot = "GX4-C351S,C8-C901SR"
    main = two_programs()

    def furnish(self):
        for number in (None, CONTACT):
            for place, world in enumerate(self.simulator.worlds):
                wired = None if number is None else number + place
                world.set_up(replace(world.parameters, contact_input=wired))

    def choose(self, number):
        """Select the robot that the properties refer to."""
        self.simulator.machine.choose(number)

    def change_needle_of(self, number):
        """Mount another needle on a robot."""
        self.choose(number)
        if number == 1:
            self.change_needle()
            return
        self.simulator.world.tips[1] = exchanged(STORED_ON_SIX_AXES, self.rng)
        self.tilt(11, TILTS)
        self.tilt(21, PROVING_TILTS)

    def tilt(self, first, tilts):
        """Teach points with the true tip on the pin and the tool tilted."""
        world, machine = self.simulator.world, self.simulator.machine
        tip, flange = world.tips[1], machine.arm.flange()
        for number, (tilt_deg, toward_deg) in enumerate(tilts, start=first):
            turned = leaning(tilt_deg, toward_deg) @ rotation_of(flange)
            at = np.array(world.pin_mm) - turned @ (tip.x_mm, tip.y_mm, tip.z_mm)
            at += [self.rng.gauss(0, 0.003) for _ in range(3)]
            u, v, w = uvw_deg(turned)
            pose = replace(
                flange, x_mm=at[0], y_mm=at[1], z_mm=at[2] - 0.02, u_deg=u, v_deg=v, w_deg=w
            )
            machine.points.store(number, Point.at(pose))

    def calibrate(self, number):
        """Run the program of a robot; return its output."""
        self.runner.console.clear()
        self.runner.start("main" if number == 1 else "main3", self.simulator.now_ns)
        printed = self.go_on()
        self.choose(number)
        return printed


def leaning(tilt_deg, toward_deg):
    """Return the rotation about a level axis that tilts a tool toward a direction."""
    tilt, toward = np.radians(tilt_deg), np.radians(toward_deg)
    x, y = -np.sin(toward), np.cos(toward)
    across = np.array([[0, 0, y], [0, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(tilt) * across + (1 - np.cos(tilt)) * across @ across
