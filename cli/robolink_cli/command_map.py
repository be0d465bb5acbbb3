"""Which commands there are: those of every day, the groups of the rest, and older names.

The first help page holds at most twelve entries; everything else stands in a group with a name
of its own (docs/decisions/0043-a-map-of-commands.md). A name that was once in use goes on
working, with the same options and the same exit codes.
"""

from typing import Final

from robolink.messages import declared

_CONTROLLER: Final = "robolink_cli.commands.controller"
_MEASURE: Final = "robolink_cli.commands.measure"
_RECORD: Final = "robolink_cli.commands.record"
_SIMULATE: Final = "robolink_cli.commands.simulate"
_COMPUTER: Final = "robolink_cli.commands.computer"
_COMPANIONS: Final = "robolink_cli.commands.companions"
_SHIPPED: Final = "robolink_cli.commands.shipped"
_GROUPS: Final = "robolink_cli.commands.groups"

_EVERY_DAY: Final = {
    "change": (
        f"{_MEASURE}.recalibrate:recalibrate",
        declared("Change a needle or nozzle: guided, measured, written, tested"),
    ),
    "status": (
        f"{_CONTROLLER}.operate:status",
        declared("What the robot is doing and which tool is selected"),
    ),
    "stop": (f"{_CONTROLLER}.operate:stop", declared("Stop every motion now")),
    "recover": (
        f"{_RECORD}.recover:recover",
        declared("After a stop, a crash or a lost link: what is open, put it right"),
    ),
    "undo": (f"{_RECORD}.undo:undo", declared("Take the last tool change back")),
}

_MEASURE_AND_MOVE: Final = {
    "calibrate": (
        f"{_MEASURE}.calibrate:calibrate",
        declared("Measure one tool, in one of many ways"),
    ),
    "tool": (
        f"{_CONTROLLER}.tool:tool",
        "list get set clear select impact backup restore compare",
    ),
    "robot": (f"{_GROUPS}:robot", "where jog motors reset release io variable"),
}

_LOOK_BACK: Final = {
    "journal": (f"{_RECORD}.journal:journal", "list show diff drift report export verify"),
}

_SET_UP: Final = {
    "cell": (f"{_GROUPS}:cell", "list show check doctor scan ports people station"),
    "sim": (f"{_SIMULATE}.sim:sim", declared("Simulated controllers to practise on")),
    "demo": (
        f"{_SIMULATE}.demo:demo",
        declared("A whole needle change on a simulated robot, nothing needed"),
    ),
}

SECTIONS: Final = {
    declared("Every day"): _EVERY_DAY,
    declared("Measure and move"): _MEASURE_AND_MOVE,
    declared("Look back"): _LOOK_BACK,
    declared("Set up"): _SET_UP,
}
"""The first help page: heading, then name, where it is and one line of help."""

SHORT_NAMES: Final = {
    "check": f"{_COMPUTER}.cell_check:check",
    "config": f"{_GROUPS}:config",
    "docs": f"{_SHIPPED}.docs:docs",
    "expert": f"{_GROUPS}:expert",
    "recipe": f"{_SHIPPED}.recipe:recipe",
}
"""Names that work and stand in no list. ``check``, ``docs`` and ``recipe`` are short for
what ``cell`` and ``expert`` list; what ``config`` held says itself how it is called now."""

RENAMED: Final = {
    "backup": (f"{_CONTROLLER}.backup:backup", "tool backup"),
    "compare": (f"{_CONTROLLER}.backup:compare", "tool compare"),
    "completion": (f"{_COMPUTER}.completion:completion", "expert completion"),
    "disable": (f"{_CONTROLLER}.operate:disable", "robot motors off"),
    "doctor": (f"{_COMPUTER}.doctor:doctor", "cell doctor"),
    "enable": (f"{_CONTROLLER}.operate:enable", "robot motors on"),
    "execute-raw": (f"{_CONTROLLER}.operate:execute_raw", "expert execute-raw"),
    "impact": (f"{_MEASURE}.impact:impact", "tool impact"),
    "io": (f"{_CONTROLLER}.io:io", "robot io"),
    "jog": (f"{_CONTROLLER}.jog:jog", "robot jog"),
    "motors": (f"{_CONTROLLER}.operate:motors", "robot motors"),
    "plc": (f"{_COMPANIONS}.plc:plc", "expert plc"),
    "ports": (f"{_COMPUTER}.ports:ports", "cell ports"),
    "poses": (f"{_MEASURE}.poses:poses", "expert poses"),
    "recalibrate": (f"{_MEASURE}.recalibrate:recalibrate", "change"),
    "release": (f"{_CONTROLLER}.operate:release", "robot release"),
    "report": (f"{_RECORD}.report:report", "journal report"),
    "reset": (f"{_CONTROLLER}.operate:reset", "robot reset"),
    "resolve": (f"{_RECORD}.recover:resolve", "recover"),
    "restore": (f"{_CONTROLLER}.backup:restore", "tool restore"),
    "scan": (f"{_COMPUTER}.scan:scan", "cell scan"),
    "serve": (f"{_COMPANIONS}.serve:serve", "expert serve"),
    "solve": (f"{_MEASURE}.solve.command:solve", "expert solve"),
    "spel": (f"{_COMPANIONS}.spel:spel", "expert spel"),
    "station": (f"{_MEASURE}.station:station", "cell station"),
    "take-ownership": (
        f"{_CONTROLLER}.take_ownership:take_ownership",
        "robot take-ownership",
    ),
    "var": (f"{_CONTROLLER}.var:var", "robot variable"),
    "verify-controller": (
        f"{_CONTROLLER}.verify_controller:verify_controller",
        "expert verify-controller",
    ),
    "where": (f"{_CONTROLLER}.operate:where", "robot where"),
}
"""Names of before: where they are, and what they are called now."""
