"""Where the commands are, by the name of their package: nothing is imported before it is run."""

from typing import Final

CONTROLLER: Final = "robolink_cli.commands.controller"
MEASURE: Final = "robolink_cli.commands.measure"
RECORD: Final = "robolink_cli.commands.record"
SIMULATE: Final = "robolink_cli.commands.simulate"
COMPUTER: Final = "robolink_cli.commands.computer"
COMPANIONS: Final = "robolink_cli.commands.companions"
SHIPPED: Final = "robolink_cli.commands.shipped"
GROUPS: Final = "robolink_cli.commands.groups"
