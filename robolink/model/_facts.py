"""What a controller says about itself."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ControllerFacts:
    """Which controller and which robots these are, as far as they can be read.

    What a firmware does not tell is ``None``, or an empty tuple.

    Attributes:
        controller_name: The name a person gave it.
        controller_type: The maker's type text.
        controller_serial: The controller's own number.
        firmware: Version text.
        project: The project loaded in it.
        robot_number: The robot that motors and statements act on.
        robot_models: One for each robot; without the extended queries, of the robot in
            force only.
        robot_serials: Likewise.
    """

    controller_name: str | None = None
    controller_type: str | None = None
    controller_serial: str | None = None
    firmware: str | None = None
    project: str | None = None
    robot_number: int | None = None
    robot_models: tuple[str, ...] = ()
    robot_serials: tuple[str, ...] = ()
