"""How a person at a shell says what the library's sentences ask for."""

from typing import Final

from robolink.messages import declared, spoken, tr
from robolink.ways import Way

SHELL_WAYS: Final = {
    Way.ACCEPT_CHANGE: "--accept-jump MM and --accept-turn DEG",
    Way.ACCEPT_JUMP: "--accept-jump",
    Way.ANSWER: "--answer {number}=TEXT",
    Way.AXES_HELD: "--axes-held; in a recipe axes_held = true",
    Way.BOX: "--box",
    Way.CALIBRATE_AT: "'robolink calibrate n-angle --station {station}'",
    Way.CALIBRATE_CAMERA_AT: "robolink calibrate camera-affine --tool {tool} --station {station}",
    Way.CALIBRATE_TOOL_AT: "robolink calibrate n-angle --tool {tool} --station {station}",
    Way.COLUMNS: "--columns",
    Way.DIALOGUE_FILE: "--record or --transcript",
    Way.EARLIER_VALUE: "--to NUMBER",
    Way.EULER: "--euler",
    Way.EXPORT_JOURNAL: "'robolink journal export --read-only'",
    Way.FORGET_MARKER: "'robolink recover --forget'",
    Way.GIVEN_POSES: "--pose",
    Way.HEIGHT: "--z {tool}=MM",
    Way.LENGTH: "--if-length-changed; in a recipe if_length_changed",
    Way.LENGTH_UNIT: "--length",
    Way.LENGTH_TOLERANCE: "--tolerance 0.05",
    Way.LIST_CHANGES: "'robolink journal list --kind done'",
    Way.LOT: "--lot ID",
    Way.NOZZLE: "--nozzle ID",
    Way.OPERATOR: "--operator",
    Way.OTHER_CONTROLLER: "give --other-controller",
    Way.OVERWRITE: "--force",
    Way.PASSWORD: "keyring, --password-file or ROBOLINK_PASSWORD",
    Way.RECORD: "--record",
    Way.REFERENCE: "--reference",
    Way.REMOTE_TIMEOUT: "--remote-timeout",
    Way.SELECTED_TOO: "--selected",
    Way.SENSOR: "--sensor",
    Way.SIGMA: "--sigma MM",
    Way.TAUGHT_POINTS: "--points",
    Way.TAUGHT_TOOL: "--taught-tool",
    Way.THEN_SELECT: "--then-select NUMBER",
    Way.TILT: "--tilt",
    Way.TOOL: "--tool",
    Way.TOOLS: "--tool",
    Way.TURN: "'robolink robot jog --turn {turn:g}'",
    Way.YES: "--yes",
}
"""Options and commands; a test holds it to every way that there is."""


_WORDS: Final = (
    declared("serious fault"),
    declared("emergency stop"),
    declared("fault"),
    declared("guard open"),
    declared("teach"),
    declared("test"),
    declared("not in remote control"),
    declared("paused"),
    declared("without power"),
    declared("disabled"),
    declared("running"),
    declared("ready"),
    declared("starting"),
    declared("remote"),
    declared("warning"),
    declared("power low"),
    declared("power high"),
    declared("right hand"),
    declared("left hand"),
    declared("powered"),
    declared("owned"),
    declared("permitted"),
    declared("simulated"),
    declared("tool known"),
    declared("selected tool"),
    declared("unfinished movements"),
    declared("map"),
)
"""What a controller, or a power mode and a hand with their noun, can be said to be."""


def state_word(code: object) -> str:
    """Return the word for a state or a flag, ``guard_open`` or ``guard open``."""
    return spoken(str(code).replace("_", " "))


def power_words(code: object) -> str:
    """Return ``power low`` or ``power high``."""
    return state_word(f"power {code}")


def hand_words(code: object) -> str:
    """Return ``right hand`` or ``left hand``."""
    return state_word(f"{code} hand")


def io_words(kind: str) -> str:
    """Return what a place of inputs and outputs is called."""
    return {"output": tr("output"), "memory": tr("memory bit"), "input": tr("input")}[kind]
