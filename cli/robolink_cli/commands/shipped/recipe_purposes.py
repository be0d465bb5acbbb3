"""What the recipes that come along are for, as a person reads it; a test holds it to the files."""

from typing import Final

from robolink.messages import declared

PURPOSES: Final = {
    "five-axes-pivot": declared(
        "A robot that can tilt its tool, a pin and a person: X, Y and Z in one measurement."
    ),
    "gantry-touch-probe": declared(
        "The length of a nozzle on a gantry (Kin_Gantry3), by a touch probe; nobody touches "
        "anything."
    ),
    "held-board": declared(
        "A board that the gripper holds, and an up-looking camera; nobody touches anything."
    ),
    "leaning-plate": declared(
        "A robot that can tilt its tool, a flat plate that leans, and a person: X, Y and Z "
        "without a pin."
    ),
    "needle-beams": declared(
        "A dispensing needle and two crossed light beams; nobody touches anything."
    ),
    "needle-one-touch": declared("The change of a dispensing needle with one touch: X, Y and Z."),
    "nozzle-and-camera": declared(
        "A nozzle and an up-looking camera that nobody has calibrated; both are found in one "
        "pattern."
    ),
    "pendant-points": declared("Points that were taught on the pendant; nothing moves."),
    "pick-nozzle-camera": declared(
        "A pick nozzle and an up-looking camera; nobody touches anything."
    ),
    "scara-pin": declared("A SCARA, a pin and a person."),
    "sphere": declared(
        "A robot that can tilt its tool, a ball, and a person: X, Y and Z without a pin."
    ),
    "two-nozzles": declared(
        "Two nozzles on one head: both are measured before one is written; all are written or none."
    ),
}
