"""Moving the robot of an EPSON controller, and switching it."""
