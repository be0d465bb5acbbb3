"""fleet agent: the process that carries plans out."""

import json
import os
import shlex
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.console.exit_codes import DIFFERENT, DONE
from robolink_cli.console.output import hand_over
from robolink_cli.console.render import json_is_on, note, say
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.session.plant_outbox import copying_meanwhile

if TYPE_CHECKING:
    from robolink.fleet.agent import Agent

NEEDED: Final = ("dbos", "prometheus_client", "sqlalchemy")
"""Packages of the extra without which no agent runs."""

LAST_S: Final = 80.0
"""How long after a signal an agent lives at most, in s: more than it waits for its jobs, and less
than a service manager waits for it."""

_SIGNALS: Final = ("SIGINT", "SIGTERM", "SIGHUP")
_SIGNALLED: Final = 128
"""Exit code of a process that a signal has ended, less the number of the signal."""

_MQTT_PASSWORD_FILE: Final = "ROBOLINK_MQTT_PASSWORD_FILE"
_NOTHING: Final[Mapping[str, str | None]] = {}
_PASSED_ON: Final = (
    *("ROBOLINK_CONFIG", "ROBOLINK_JOURNAL", "ROBOLINK_PASSWORD_FILE", "ROBOLINK_PLANT"),
    *("ROBOLINK_STATE_DIR", _MQTT_PASSWORD_FILE),
)
"""What says where cell files, record and plans are."""

Backups = Annotated[
    Path | None,
    click.Path(file_okay=False, path_type=Path),
    CliOption(
        metavar="FOLDER",
        help="Where backups are saved; fleet-backups in the state folder unless given.",
    ),
]


@click.command("agent", short_help="Carry out the plans of a plant, until it is ended.")
@json_option
def agent(
    *,
    plant: Annotated[str, LINE, CliArgument()] = "plant",
    backups: Backups = None,
    systemd: Annotated[
        bool, CliOption(help="Print a unit for systemd, which starts and watches it, and end.")
    ] = False,
    metrics: Annotated[
        str | None,
        LINE,
        CliOption(
            metavar="[HOST:]PORT",
            help="Serve metrics to Prometheus there; this computer alone unless HOST is given.",
        ),
    ] = None,
    mqtt: Annotated[
        str | None,
        LINE,
        CliOption(
            metavar="URL",
            help="Publish states and events to this broker: mqtts://user@host:8883/prefix.",
        ),
    ] = None,
    mqtt_plain: Annotated[
        str,
        LINE,
        CliOption(metavar="HOST", help="Reach the broker on this host without TLS (mqtt://)."),
    ] = "",
) -> None:
    """Carry out the plans of PLANT at the cells of this computer's cell files, until Ctrl-C.

    It moves no robot: it saves backups, checks cells, reads charts and writes offsets. Of a plant
    one agent runs on each computer that is the home of cells; what one that was killed had begun,
    the next one there goes on with. A watchdog starts that one: --systemd prints a unit. Ctrl-C and
    SIGTERM let the cells at work finish.
    """
    if systemd:
        outward = {"--metrics": metrics, "--mqtt": mqtt, "--mqtt-plain": mqtt_plain}
        hand_over(unit(plant, backups, outward))
        return
    with (
        agent_here(plant, backups) as made,
        _metrics_of(made, plant, metrics) as url,
        _published_to(mqtt, plant, mqtt_plain) as broker,
    ):
        if json_is_on():
            about = {"schema": "robolink/fleet-agent/1", "plant": plant, "home": made.home}
            hand_over(json.dumps({**about, "pid": os.getpid(), "metrics": url, "mqtt": broker}))
        else:
            say(tr("Agent of plant {plant}. Ctrl-C ends it.", plant=plant))
            if url is not None:
                say(tr("Metrics: {url}", url=url))
            if broker is not None:
                say(tr("Messages: {url}", url=broker))
            sys.stdout.flush()
        with copying_meanwhile(), ended_by_signals(made):
            made.run()
    leave(made, DONE)


@contextmanager
def agent_here(
    plant: str, backups: Path | None = None, tell: Callable[[str], None] = note
) -> Iterator["Agent"]:
    """Have an agent for this computer's cells, which hears their stops within the block.

    Raises:
        ConfigError: The extra ``fleet`` is not installed.
    """
    require_packages()
    from robolink.files.durable import state_folder
    from robolink.fleet import default_plant
    from robolink.fleet.agent import Agent
    from robolink.fleet.plant_view.home_record import HomeRecord
    from robolink_cli.commands.fleet.acts import CellActs

    place = default_plant()
    with CellActs(backups or state_folder("fleet-backups"), tell=tell) as acts:
        record = HomeRecord(place, plant, acts.cells, tell=tell)
        noted, cells = record.noted_meanwhile, acts.cells
        yield Agent(place, plant, acts, line=acts, cells=cells, meanwhile=noted, tell=tell)


@contextmanager
def _metrics_of(made: "Agent", plant: str, address: str | None) -> Iterator[str | None]:
    """Serve the metrics of a plant, if an address is given, and yield their URL."""
    if address is None:
        yield None
        return
    from robolink.fleet import PlantNotes, default_plant
    from robolink.fleet.plant_view.metrics import PlantMetrics, metrics_served
    from robolink_cli.commands.simulate.service import host_and_port

    host, port = host_and_port(address, "--metrics")
    notes = PlantNotes(default_plant(), plant)  # never closed: that would wait for a look
    with metrics_served(host, port, PlantMetrics(notes.look, lambda: made.turned_s)) as url:
        yield url


@contextmanager
def _published_to(url: str | None, plant: str, plain_host: str) -> Iterator[str | None]:
    """Publish what a plant tells to a broker, if one is named, and yield its URL.

    Raises:
        ConfigError: The URL or the password is wrong, or the extra ``mqtt`` is not installed.
    """
    if url is None:
        yield None
        return
    if find_spec("paho") is None:
        raise ConfigError(
            tr("Messages to a broker need a package that is missing: paho-mqtt."),
            remedy=tr("Run: python -m pip install 'robolink[mqtt]'"),
        )
    from robolink.config.passwords import from_keyring, from_places
    from robolink.fleet import PlantNotes, default_plant
    from robolink.fleet.plant_view.mqtt_feed import MqttFeed, broker_of, publisher_lock

    broker = broker_of(url, plain_host=plain_host)
    password = None
    if broker.user:
        password = from_keyring(broker.url) or from_places(
            os.environ.get(_MQTT_PASSWORD_FILE), "ROBOLINK_MQTT_PASSWORD"
        )
    notes = PlantNotes(default_plant(), plant)  # never closed: that would wait for a look
    lock = publisher_lock(default_plant(), plant, broker)
    with MqttFeed(broker, notes, plant, password=password, lock=lock, tell=note).running():
        yield broker.url


def require_packages() -> None:
    """Refuse to go on without the packages of the extra.

    Raises:
        ConfigError: One is missing; says how it is installed.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise ConfigError(
            tr("An agent needs packages that are missing: {names}.", names=", ".join(missing)),
            remedy=tr("Run: python -m pip install 'robolink[fleet]'"),
        )


@contextmanager
def ended_by_signals(agent: "Agent") -> Iterator[None]:
    """End an agent in order at Ctrl-C, SIGTERM and a closed window, within the block.

    If anything hangs, a server that does not answer or a disk, the process ends all the same.
    """

    def end(number: int, _frame: object) -> None:
        agent.end()
        threading.Thread(target=end_at_last, args=(number,), daemon=True).start()

    def end_at_last(number: int) -> None:
        time.sleep(LAST_S)
        note(tr("The agent hangs, and ends without its jobs: the next one delivers them again."))
        os._exit(_SIGNALLED + number)

    numbers = [getattr(signal, name) for name in _SIGNALS if hasattr(signal, name)]
    before: list[tuple[int, Any]] = [(number, signal.signal(number, end)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def leave(agent: "Agent", code: int) -> int:
    """Return the exit code of an agent that has ended; end the process where jobs of it hang.

    Python would wait for their threads for ever.
    """
    if not agent.hung:
        return code
    jobs = ", ".join(sorted(agent.hung))
    note(tr("These jobs hang, and end with this process: {jobs}.", jobs=jobs))
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(code or DIFFERENT)


def unit(
    plant: str, backups: Path | None = None, outward: Mapping[str, str | None] = _NOTHING
) -> str:
    """Return a unit of systemd that runs this agent as this user, from this folder.

    Raises:
        ConfigError: A password stands in what it would have to name, or an agent would refuse the
            broker.
    """
    from robolink.fleet.plant_view.mqtt_feed import broker_of
    from robolink.fleet.watchdog import UNIT
    from robolink.journal import this_process
    from robolink.journal._places import place_of

    if broker := outward.get("--mqtt"):
        broker_of(broker, plain_host=outward.get("--mqtt-plain") or "")
    words = [sys.executable, "-m", "robolink_cli", "fleet", "agent", plant]
    words += [] if backups is None else ["--backups", str(backups.absolute())]
    words += [word for name, said in outward.items() if said for word in (name, said)]
    named = {name: os.environ[name] for name in _PASSED_ON if os.environ.get(name)}
    for name in {"ROBOLINK_JOURNAL", "ROBOLINK_PLANT"} & named.keys():
        if "://" in named[name] and place_of(named[name]).location != _with_driver(named[name]):
            raise ConfigError(
                tr("{name} holds a password, which a unit would show.", name=name),
                remedy=tr("Put it into the file .pgpass of this user, and leave it out there."),
            )
    return UNIT.format(
        plant=plant,
        user=this_process().os_user,
        folder=Path.cwd(),
        environment="".join(f'Environment="{name}={value}"\n' for name, value in named.items()),
        command=shlex.join(words),
    ).replace("%", "%%")


def _with_driver(url: str) -> str:
    return url.replace("postgresql://", "postgresql+psycopg://", 1)
