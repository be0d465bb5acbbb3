"""How a person at a shell says what the library's sentences ask for."""

from typing import Final

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
