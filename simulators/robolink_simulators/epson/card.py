"""What a controller says of itself when it is asked; a test may give it any words."""

from dataclasses import dataclass, field


@dataclass(slots=True)
class ControllerCard:
    """Texts of the extended queries; the values are the simulator's own.

    Source: docs/reference/epson.md 1.8.

    Attributes:
        name: Its name, ``0`` if none was given.
        kind: Its type.
        project: The project in it.
        robot_name: The name of its robot.
        camera: The model of the camera of its vision system.
        force_sensor: The serial number of its force sensor.
        settings: What GetContSettings tells in place of the preferences, if anything.
        messages: Texts of error numbers; the others have texts of the simulator's own.
    """

    name: str = "SIMULATED"
    kind: str = "SIMULATOR"
    project: str = "robolink"
    robot_name: str = "Robot1"
    camera: str = "0"
    force_sensor: str = "0"
    settings: str = ""
    messages: dict[int, str] = field(default_factory=dict)
