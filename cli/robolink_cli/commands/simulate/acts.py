"""Actions at a simulated cell from the shell."""

from collections.abc import Mapping, Sequence

from robolink_simulators.control.acts import texts_of
from robolink_simulators.control.assist import AssistClient
from robolink_simulators.control.client import ControlClient

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.commands.simulate.service import named_values
from robolink_cli.console.numbers import decimal
from robolink_cli.console.render import emit, say


def do_act(url: str, act: str, values: Sequence[str]) -> None:
    """Carry out ``act`` at the simulator behind ``url`` and show its result.

    Raises:
        ConfigError: A value is not NAME=NUMBER, or the simulator cannot do it and says why.
        ConnectError: No simulator is there.
    """
    parameters = dict(_parsed(value) for value in values)
    with AssistClient(url) as client:
        answer = client.do(act, **parameters)
    emit("assist", {"act": act, **answer}, lambda: _show_answer(act, answer))


def do_controlled(url: str, act: str, values: Sequence[str]) -> None:
    """Carry out ``act`` through the control API behind ``url`` and show its result.

    Raises:
        ConfigError: A value is not NAME=VALUE, or the simulator cannot do it and says why.
        ConnectError: No simulator is there.
    """
    texts = texts_of(act)
    given = {
        name: text if name in texts else _typed(text)
        for name, text in named_values(values, "add_fault action=drop_reply").items()
    }
    with ControlClient(url) as client:
        answer = client.do(act, **given)
    emit("control", {"act": act, **answer}, lambda: _show_answer(act, answer))


def _show_answer(act: str, answer: Mapping[str, object]) -> None:
    say(tr("{act}: done", act=act))
    for name, value in answer.items():
        say(f"  {name}: {_shown(value)}")


def _typed(text: str) -> bool | int | float | str:
    """Return the value of a word on the command line: a number, true or false, else a text."""
    if text in ("true", "false"):
        return text == "true"
    try:
        number = decimal(text)
    except ValueError:
        return text
    return int(number) if number.is_integer() and "." not in text else number


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_shown(part)}" for name, part in value.items())
    if isinstance(value, list):
        return " ".join(_shown(part) for part in value)
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return tr("none")
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def _parsed(text: str) -> tuple[str, float | int]:
    name, equals, value = text.partition("=")
    try:
        number = decimal(value)
    except ValueError:
        equals = ""
    if not (name and equals):
        raise ConfigError(
            tr("{text!r} is not NAME=NUMBER.", text=text),
            remedy=tr("For example number=901 u_deg=180."),
        )
    return name, int(number) if number.is_integer() else number
