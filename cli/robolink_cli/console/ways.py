"""How a person at a shell says what the library's sentences ask for."""

from typing import Final

from robolink.ways import Way

SHELL_WAYS: Final = {
    Way.DIALOGUE_FILE: "--record or --transcript",
    Way.EARLIER_VALUE: "--to NUMBER",
    Way.EXPORT_JOURNAL: "'robolink journal export --read-only'",
    Way.FORGET_MARKER: "'robolink recover --forget'",
    Way.GIVEN_POSES: "--pose",
    Way.LENGTH_TOLERANCE: "--tolerance 0.05",
    Way.LIST_CHANGES: "'robolink journal list --kind done'",
    Way.OPERATOR: "--operator",
    Way.OTHER_CONTROLLER: "give --other-controller",
    Way.OVERWRITE: "--force",
    Way.PASSWORD: "keyring, --password-file or ROBOLINK_PASSWORD",
    Way.RECORD: "--record",
    Way.REMOTE_TIMEOUT: "--remote-timeout",
    Way.SELECTED_TOO: "--selected",
    Way.THEN_SELECT: "--then-select NUMBER",
    Way.TOOL: "--tool",
    Way.TOOLS: "--tool",
}
"""Options and commands; a test holds it to every way that there is."""
