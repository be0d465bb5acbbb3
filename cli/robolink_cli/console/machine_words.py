"""The words for the state of a machine, in the language of the person.

They are made as codes that records and JSON keep; what no one has translated is shown as it is.
"""

from typing import Final

from robolink.messages import declared, spoken, tr

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
