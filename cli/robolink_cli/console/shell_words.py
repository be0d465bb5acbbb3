"""The library's requests in the words of a shell user."""

from typing import Final

from robolink.messages import declared, spoken, tr
from robolink.remedy_words import RemedyWord

SHELL_WAYS: Final = {
    RemedyWord.ACCEPT_CHANGE: "--accept-jump MM and --accept-turn DEG",
    RemedyWord.ACCEPT_JUMP: "--accept-jump",
    RemedyWord.ANSWER: "--answer {number}=TEXT",
    RemedyWord.AXES_HELD: "--axes-held; in a recipe axes_held = true",
    RemedyWord.BOX: "--box",
    RemedyWord.CALIBRATE_AT: "'robolink calibrate n-angle --station {station}'",
    RemedyWord.CALIBRATE_CAMERA_AT: (
        "robolink calibrate camera-affine --tool {tool} --station {station}"
    ),
    RemedyWord.CALIBRATE_TOOL_AT: "robolink calibrate n-angle --tool {tool} --station {station}",
    RemedyWord.COLUMNS: "--columns",
    RemedyWord.DIALOGUE_FILE: "--record or --transcript",
    RemedyWord.EARLIER_VALUE: "--to NUMBER",
    RemedyWord.END_HOLDER: "robolink recover --take-over REASON",
    RemedyWord.EULER: "--euler",
    RemedyWord.EXPORT_JOURNAL: "'robolink journal export --read-only'",
    RemedyWord.FORGET_MARKER: "'robolink recover --forget'",
    RemedyWord.GIVEN_POSES: "--pose",
    RemedyWord.HEIGHT: "--z {tool}=MM",
    RemedyWord.LENGTH: "--if-length-changed",
    RemedyWord.LENGTH_UNIT: "--length",
    RemedyWord.LENGTH_TOLERANCE: "--tolerance 0.05",
    RemedyWord.LIST_CHANGES: "'robolink journal list --kind done'",
    RemedyWord.LOT: "--lot ID",
    RemedyWord.NOZZLE: "--nozzle ID",
    RemedyWord.OPERATOR: "--operator",
    RemedyWord.OTHER_CONTROLLER: "give --other-controller",
    RemedyWord.OVERWRITE: "--force",
    RemedyWord.PASSWORD: "keyring, --password-file or ROBOLINK_PASSWORD",
    RemedyWord.RECORD: "--record",
    RemedyWord.REFERENCE: "--reference",
    RemedyWord.REMOTE_TIMEOUT: "--remote-timeout",
    RemedyWord.RENEW_CERTIFICATE: "robolink cell certificate --replace",
    RemedyWord.SELECTED_TOO: "--selected",
    RemedyWord.SENSOR: "--sensor",
    RemedyWord.SIGMA: "--sigma MM",
    RemedyWord.TAUGHT_POINTS: "--points",
    RemedyWord.TAUGHT_TOOL: "--taught-tool",
    RemedyWord.THEN_SELECT: "--then-select NUMBER",
    RemedyWord.TILT: "--tilt",
    RemedyWord.TOOL: "--tool",
    RemedyWord.TOOLS: "--tool",
    RemedyWord.TURN: "'robolink robot jog --turn {turn:g}'",
    RemedyWord.WAIT: "--wait SECONDS",
    RemedyWord.YES: "--yes",
}
"""Options and commands by remedy word. A test checks that every remedy word is here."""


_WORDS: Final = (
    declared("serious fault"),
    declared("emergency stop"),
    declared("fault"),
    declared("guard open"),
    declared("teach"),
    declared("test"),
    declared("not in remote control"),
    declared("paused"),
    declared("held by a stop"),
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
"""Translatable words for the state of a controller, and for a power mode and a hand with their
nouns.
"""


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
