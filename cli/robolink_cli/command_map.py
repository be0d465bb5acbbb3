"""The commands: those of every day, the groups of the rest, and older names.

The first help page holds at most twelve entries; everything else stands in a group with a name
of its own (docs/decisions/0043-a-map-of-commands.md). A name that was once in use goes on
working, with the same options and the same exit codes.
"""

from typing import Final

from robolink.messages import declared

CONTROLLER: Final = "robolink_cli.commands.controller"
MEASURE: Final = "robolink_cli.commands.measure"
RECORD: Final = "robolink_cli.commands.record"
SIMULATE: Final = "robolink_cli.commands.simulate"
COMPUTER: Final = "robolink_cli.commands.computer"
COMPANIONS: Final = "robolink_cli.commands.companions"
SHIPPED: Final = "robolink_cli.commands.shipped"
FLEET: Final = "robolink_cli.commands.fleet"
GROUPS: Final = "robolink_cli.commands.groups"


_EVERY_DAY: Final = {
    "change": (
        f"{MEASURE}.recalibrate:recalibrate",
        declared("Change a needle or nozzle: guided, measured, written, tested"),
    ),
    "status": (
        f"{CONTROLLER}.operate:status",
        declared("Show what the robot is doing and which tool is selected"),
    ),
    "stop": (f"{CONTROLLER}.operate:stop", declared("Stop the robot now")),
    "recover": (
        f"{RECORD}.recover:recover",
        declared("Finish or undo an interrupted job: stop, crash, lost link"),
    ),
    "undo": (f"{RECORD}.undo:undo", declared("Undo the last tool change")),
}

_MEASURE_AND_MOVE: Final = {
    "calibrate": (
        f"{MEASURE}.calibrate:calibrate",
        declared("Measure one tool, in one of many ways"),
    ),
    "tool": (
        f"{CONTROLLER}.tool:tool",
        "list get set clear select impact backup restore compare",
    ),
    "robot": (f"{GROUPS}:robot", "where jog motors reset release io variable"),
}

_LOOK_BACK: Final = {
    "journal": (
        f"{RECORD}.journal:journal",
        "list show checks diff drift report export verify sync",
    ),
}

_SET_UP: Final = {
    "cell": (f"{GROUPS}:cell", "list new show tools check doctor scan people station eye accuracy"),
    "sim": (f"{SIMULATE}.sim:sim", declared("Simulated controllers to practise on")),
    "panel": (f"{COMPUTER}.panel:panel", declared("Pages for a tablet at the cell")),
}

SECTIONS: Final = {
    declared("Every day"): _EVERY_DAY,
    declared("Measure and move"): _MEASURE_AND_MOVE,
    declared("Look back"): _LOOK_BACK,
    declared("Set up"): _SET_UP,
}
"""The first help page: headings, and below each the commands by name, with their module and one
line of help.
"""

SHORT_NAMES: Final = {
    "check": f"{COMPUTER}.cell_check:check",
    "check-contract": f"{CONTROLLER}.check_contract:check_contract",
    "config": f"{GROUPS}:config",
    "demo": f"{SIMULATE}.demo:demo",
    "docs": f"{SHIPPED}.docs:docs",
    "expert": f"{GROUPS}:expert",
    "eye": f"{MEASURE}.eye:eye",
    "fleet": f"{FLEET}.command:fleet",
    "recipe": f"{SHIPPED}.recipe:recipe",
}
"""Names that work but are not listed; the line below the list names ``demo``. ``check``,
``check-contract``, ``demo``, ``docs``, ``eye``, ``fleet`` and ``recipe`` are short for commands
listed under ``cell`` and ``expert``. The former commands of ``config`` name their replacements.
"""

RENAMED: Final = {
    "backup": (f"{CONTROLLER}.backup:backup", "tool backup"),
    "compare": (f"{CONTROLLER}.backup:compare", "tool compare"),
    "completion": (f"{COMPUTER}.completion:completion", "expert completion"),
    "disable": (f"{CONTROLLER}.operate:disable", "robot motors off"),
    "doctor": (f"{COMPUTER}.doctor:doctor", "cell doctor"),
    "enable": (f"{CONTROLLER}.operate:enable", "robot motors on"),
    "execute-raw": (f"{CONTROLLER}.operate:execute_raw", "expert execute-raw"),
    "impact": (f"{MEASURE}.impact:impact", "tool impact"),
    "io": (f"{CONTROLLER}.io:io", "robot io"),
    "jog": (f"{CONTROLLER}.jog:jog", "robot jog"),
    "motors": (f"{CONTROLLER}.operate:motors", "robot motors"),
    "plc": (f"{COMPANIONS}.plc:plc", "expert plc"),
    "ports": (f"{COMPUTER}.ports:ports", "cell ports"),
    "poses": (f"{MEASURE}.poses:poses", "expert poses"),
    "recalibrate": (f"{MEASURE}.recalibrate:recalibrate", "change"),
    "release": (f"{CONTROLLER}.operate:release", "robot release"),
    "report": (f"{RECORD}.report:report", "journal report"),
    "reset": (f"{CONTROLLER}.operate:reset", "robot reset"),
    "resolve": (f"{RECORD}.recover:resolve", "recover"),
    "restore": (f"{CONTROLLER}.backup:restore", "tool restore"),
    "scan": (f"{COMPUTER}.scan:scan", "cell scan"),
    "serve": (f"{COMPANIONS}.serve:serve", "expert serve"),
    "solve": (f"{MEASURE}.solve.command:solve", "expert solve"),
    "spel": (f"{COMPANIONS}.spel:spel", "expert spel"),
    "station": (f"{MEASURE}.station:station", "cell station"),
    "take-ownership": (
        f"{CONTROLLER}.operate:take_ownership",
        "robot take-ownership",
    ),
    "var": (f"{CONTROLLER}.var:var", "robot variable"),
    "verify-controller": (
        f"{CONTROLLER}.verify_controller:verify_controller",
        "expert verify-controller",
    ),
    "where": (f"{CONTROLLER}.operate:where", "robot where"),
}
"""Former names, each with its module and its present name."""
