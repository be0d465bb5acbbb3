"""sim epson --replay: serving a recorded dialogue."""

import json
from collections.abc import Callable
from pathlib import Path

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.output import hand_over, show
from robolink_cli.console.render import json_is_on, note

_OF_A_REPLAY = frozenset({"address", "replay", "allow_remote"})


def serve_recording(
    recording: Path, address: tuple[str, int], *, allow_remote: bool, wait: Callable[[], None]
) -> None:
    """Serve a recording until ``wait`` returns; what a client does otherwise is noted.

    Raises:
        ConfigError: The file is no recording, or an option was given that says how a
            simulator behaves: a recording behaves as recorded.
    """
    from robolink_simulators.hosting.replay import ReplayDevice, read_recording, serve_replay

    _refuse_habits()
    dialogues = read_recording(recording)
    device = ReplayDevice(dialogues, on_difference=note)
    with serve_replay(device, *address, allow_remote=allow_remote) as host:
        _announce(host.url, recording, len(dialogues))
        wait()


def _refuse_habits() -> None:
    context = click.get_current_context()
    for parameter in context.command.params:
        name = str(parameter.name)
        given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if given and parameter.expose_value and name not in _OF_A_REPLAY:
            raise ConfigError(
                tr("{option} does not go with --replay.", option=parameter.opts[0]),
                remedy=tr("A recording answers what was recorded, and nothing else."),
            )


def _announce(url: str, recording: Path, connections: int) -> None:
    if json_is_on():
        document = {
            "schema": "robolink/sim/1",
            "url": url,
            "replay": str(recording),
            "connections": connections,
            "simulated": True,
        }
        hand_over(json.dumps(document))
        return
    lines = (
        tr(
            "REPLAY of {path} ({count} connections). No robot moves.",
            path=recording,
            count=connections,
        ),
        tr("  controller  {url}", url=url),
        tr("Ctrl-C ends it."),
    )
    show("\n".join(lines))
