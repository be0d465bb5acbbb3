"""What a plant tells an MQTT broker: states that are retained, and what happened, in order.

Nothing comes in: the client subscribes to nothing, and what a broker sends all the same is dropped.
States are published again after each connecting. Events come from the plant's database, and the
last one that the broker has acknowledged is noted there: so each is delivered at least once and in
order, however often broker, agent or database end in between.

Of the agents of a plant that publish to the same topics, one does so at a time: who has the lock.
The others are not connected to the broker, lest the last will of one says that the other is gone.
Whoever has the lock and no connection to the broker gives the lock up: another may reach it.
"""

import json
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final
from urllib.parse import quote, urlsplit

from robolink import runtime
from robolink.errors import ConfigError, LeaseHeldError, RobolinkError
from robolink.fleet.agent_lock import AgentLock
from robolink.fleet.plant_view.notes import PlanSummary, PlantLook, PlantNotes
from robolink.fleet.states import JobState
from robolink.journal._places import place_of
from robolink.messages import tr
from robolink.model import Secret
from robolink.plug_ins import unexpected
from robolink.transport import parse_url

if TYPE_CHECKING:
    from paho.mqtt.client import Client, MQTTMessageInfo
    from paho.mqtt.reasoncodes import ReasonCode

EVERY_S: Final = 1.0
"""Pause between two looks at the plant's database, s."""

ACK_S: Final = 5.0
"""Longest wait for acknowledgements in one step, s; the next one goes on waiting."""

AT_ONCE: Final = 100
"""Most messages that are not acknowledged yet."""

_KEEP_ALIVE_S: Final = 30
"""Longest silence of a connection, s; after 1.5 times as long the broker says that it is gone."""

AWAY_S: Final = 2.0 * _KEEP_ALIVE_S
"""How long who has the lock tries a broker that it is not connected to, s: until its last will
has been said, so that this does not follow what the next one says."""

WAIT_S: Final = 5.0
"""Pause before the lock that another agent has is asked for again, s."""

_RETRY_S: Final = (1, 60)
"""Shortest and longest pause before the broker is tried again, s."""

_END_S: Final = 3.0
_PORTS: Final = {"mqtt": 1883, "mqtts": 8883}


@dataclass(frozen=True, slots=True)
class MqttBroker:
    """Where a plant's messages go.

    Attributes:
        host: Its name or address.
        port: Its port.
        user: In whose name; empty for nobody.
        prefix: How all topics begin.
        secure: Whether it is reached over TLS.
    """

    host: str
    port: int
    user: str
    prefix: str
    secure: bool

    @property
    def url(self) -> str:
        """It as a URL, without a password."""
        user = f"{self.user}@" if self.user else ""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'mqtts' if self.secure else 'mqtt'}://{user}{host}:{self.port}/{self.prefix}"


def broker_of(url: str, *, plain_host: str = "") -> MqttBroker:
    """Return the broker that a URL names.

    Args:
        url: ``mqtts://user@host:8883/prefix``.
        plain_host: The one host, besides this computer, that may be reached without TLS.

    Raises:
        ConfigError: It is no such URL, holds a password, or would send everything in the clear.

    Example:
        >>> from robolink.fleet.plant_view.mqtt_feed import broker_of
        >>> broker_of("mqtts://line@broker.plant/robots").url
        'mqtts://line@broker.plant:8883/robots'
    """
    example = tr("Write for example: mqtts://user@broker.plant:8883/robots")
    try:
        said = urlsplit(url)
        host, port = said.hostname or "", said.port
    except ValueError:
        said, host, port = urlsplit(""), "", None
    prefix = said.path.strip("/")
    if said.scheme not in _PORTS or not host or said.query or said.fragment or "#" in prefix:
        raise ConfigError(tr("This is not the URL of an MQTT broker."), remedy=example)
    if set(prefix) & set("+$\0") or any(character < " " for character in prefix):
        raise ConfigError(tr("Topics cannot begin with {prefix!r}.", prefix=prefix), remedy=example)
    if said.password is not None:
        raise ConfigError(
            tr("The URL of the broker holds a password."),
            remedy=tr("Leave it out, and put it into ROBOLINK_MQTT_PASSWORD_FILE or the keyring."),
        )
    secure = said.scheme == "mqtts"
    here = parse_url(
        f"epson+tcp://[{host}]:1" if ":" in host else f"epson+tcp://{host}:1"
    ).stays_here
    if not (secure or here or host == plain_host.lower()):
        raise ConfigError(
            tr("Everything would reach {host} unencrypted.", host=host),
            remedy=tr("Use mqtts://, or name {host} as one that is told without TLS.", host=host),
        )
    return MqttBroker(
        host, port or _PORTS[said.scheme], said.username or "", prefix or "robolink", secure
    )


def publisher_lock(location: str, plant: str, broker: MqttBroker) -> AgentLock | None:
    """Return the lock of who publishes to a broker; ``None`` in a file, which has one agent.

    Args:
        location: The plant's database: path of a file, or URL of PostgreSQL.
        plant: Id of the plant.
        broker: The broker.

    Raises:
        JournalError: The location is none.
    """
    if place_of(location).path is not None:
        return None
    return AgentLock(location, plant, _name_of(broker))


class MqttFeed:
    """Publishes the states and events of a plant to a broker.

    Args:
        broker: Where to.
        notes: The plant's database, with a connection that nobody else uses.
        plant: Id of the plant.
        password: Of the broker's user.
        lock: Whoever publishes has it; without one, nobody else does.
        tell: Receives sentences for people, each trouble once.
    """

    def __init__(
        self,
        broker: MqttBroker,
        notes: PlantNotes,
        plant: str,
        *,
        password: Secret | None = None,
        lock: AgentLock | None = None,
        tell: Callable[[str], None] = lambda _sentence: None,
    ) -> None:
        self._broker, self._notes, self._lock, self._tell = broker, notes, lock, tell
        self._plant = plant
        self._root = f"{broker.prefix}/{_level(plant)}"
        self._position = _name_of(broker)
        self._begun = False
        self._published: dict[str, str] = {}
        self._pending: list[MQTTMessageInfo] = []
        self._acknowledged: Callable[[], None] = lambda: None
        self._connected = threading.Event()
        self._lost = threading.Event()
        self._ending = threading.Event()
        self._trouble = ""
        self._publisher = ""
        self._heard_s = self._asks_s = 0.0
        self._password = password
        self._client = self._made(password)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Publish while the block runs; at its end the broker is told that the agent is gone."""
        thread = threading.Thread(target=self._run, name="messages of the plant", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._ending.set()
            thread.join(_END_S)  # one that waits for a database that hangs ends with the process
            self._leave(says_so=True)

    def _run(self) -> None:
        while not self._ending.wait(EVERY_S):
            try:
                if self._has_turn():
                    self.step()
            except RobolinkError as error:
                self._say(str(error))
            except Exception as error:  # a defect is told, too, and ends no later step
                self._say(unexpected(error))

    def _has_turn(self) -> bool:
        """Whether this feed publishes; it is connected as long as it does.

        Raises:
            PlantError: The database cannot be used. Whose turn it is shows when it answers.
        """
        now_s = runtime.monotonic_ns() / 1e9
        if self._connected.is_set():
            self._heard_s = now_s
        elif self._begun and self._lock is not None and now_s > self._heard_s + AWAY_S:
            self._leave(says_so=False)
            self._asks_s = now_s + 2 * WAIT_S  # whoever waits asks before
        if self._lock is not None and not self._lock.is_held():
            if now_s < self._asks_s:
                return False
            try:
                self._lock.take()
            except LeaseHeldError as error:
                self._leave(says_so=False)
                self._asks_s = now_s + WAIT_S
                self._wait_for(error.holder)
                return False
        if not self._begun:
            self._begun, self._heard_s = True, now_s
            self._client.connect_async(
                self._broker.host, self._broker.port, keepalive=_KEEP_ALIVE_S
            )
            self._client.loop_start()
        return True

    def _wait_for(self, publisher: str) -> None:
        """Tell who publishes, once."""
        if publisher != self._publisher:
            self._tell(
                tr(
                    "{who} publishes to the broker {url}. This agent takes over when that one "
                    "ends, or has no connection to the broker for {seconds} s.",
                    who=publisher,
                    url=self._broker.url,
                    seconds=f"{AWAY_S:.0f}",
                )
            )
        self._publisher = publisher

    def _leave(self, *, says_so: bool) -> None:
        """Disconnect from the broker; what it has not acknowledged is read anew, here or elsewhere.

        Args:
            says_so: Whether nobody else publishes, so that it is told that the agent is gone.
        """
        if not self._begun:
            return
        client = self._client
        if self._connected.is_set() and says_so:
            with suppress(ValueError, RuntimeError):
                said = client.publish(self._agent_topic, self._agent(up=False), 1, retain=True)
                said.wait_for_publish(_END_S)
        client.disconnect()
        client.loop_stop()
        self._connected.clear()
        self._begun, self._client = False, self._made(self._password)
        self._pending, self._acknowledged = [], lambda: None
        if self._lock is not None:
            self._lock.release()

    def step(self) -> None:
        """Publish what is new, as far as the broker takes it.

        Raises:
            PlantError: The database cannot be used; the next step makes up for it.
        """
        if not self._connected.is_set():
            return
        if self._lost.is_set():  # a broker that was away may have lost what it retained
            self._lost.clear()
            self._published.clear()
        if not self._settled():
            return
        # Before the first states: who has seen them misses nothing that follows.
        if self._notes.position(self._position) is None:
            self._notes.note({}, {self._position: ("", self._notes.last_event())})
        for send in (self._events, self._states):  # no number of states keeps an event waiting
            while send() and not self._ending.is_set():
                if not self._settled():
                    return

    def _states(self) -> bool:
        """Publish retained states that changed; return whether anything was published."""
        now = dict(self._documents(self._notes.look()))
        gone = dict.fromkeys(self._published.keys() - now.keys(), "")
        changed = {
            topic: text
            for topic, text in (now | gone).items()
            if self._published.get(topic) != text
        }
        some = dict(list(changed.items())[:AT_ONCE])

        def acknowledged() -> None:
            self._published |= some
            for topic in some.keys() & gone.keys():
                del self._published[topic]

        self._publish(some.items(), acknowledged, retain=True)
        return bool(some)

    def _events(self) -> bool:
        """Publish the next events; return whether there were any."""
        begun = self._notes.position(self._position)
        events = self._notes.events(begun[1], AT_ONCE) if begun else ()
        if not events:
            return False
        last = events[-1][0]
        topic = f"{self._root}/events"
        messages = [
            (topic, _text({"schema": "robolink/mqtt-event/1", "number": number, **event}))
            for number, event in events
        ]

        def acknowledged() -> None:
            self._notes.note({}, {self._position: ("", last)})

        self._publish(messages, acknowledged, retain=False)
        return True

    def _publish(
        self,
        messages: Iterable[tuple[str, str]],
        acknowledged: Callable[[], None],
        *,
        retain: bool,
    ) -> None:
        from paho.mqtt.enums import MQTTErrorCode

        self._acknowledged = acknowledged
        self._pending = [
            self._client.publish(topic, text, qos=1, retain=retain) for topic, text in messages
        ]
        for one in self._pending:
            if one.rc is MQTTErrorCode.MQTT_ERR_NO_CONN:
                # The client keeps it, and sends it once it is connected again.
                one.rc = MQTTErrorCode.MQTT_ERR_SUCCESS

    def _settled(self) -> bool:
        """Wait for what is not acknowledged yet; return whether all is.

        What was published is never published again by another call: the client keeps it until the
        broker has acknowledged it, over a new connection too.
        """
        end_s = runtime.monotonic_ns() / 1e9 + ACK_S
        for one in self._pending:
            left_s = end_s - runtime.monotonic_ns() / 1e9
            with suppress(ValueError, RuntimeError):
                one.wait_for_publish(max(0.0, left_s))
            if not one.is_published():
                return False
        self._pending = []
        acknowledged, self._acknowledged = self._acknowledged, lambda: None
        try:
            acknowledged()
        except RobolinkError:
            self._acknowledged = acknowledged  # to note it again is safe
            raise
        return True

    def _documents(self, look: PlantLook) -> Iterator[tuple[str, str]]:
        yield self._agent_topic, self._agent(up=True)
        for name, state in look.cells.items():
            about = {"schema": "robolink/mqtt-cell/1", "plant": self._plant}
            yield f"{self._root}/cells/{_level(name)}", _text({**about, **state.as_json(name)})
        for plan in look.plans:
            about = {"schema": "robolink/mqtt-plan/1", "plant": self._plant}
            yield f"{self._root}/plans/{plan.id}", _text({**about, **_plan(plan)})

    @property
    def _agent_topic(self) -> str:
        return f"{self._root}/agent"

    def _agent(self, *, up: bool) -> str:
        return _text({"schema": "robolink/mqtt-agent/1", "plant": self._plant, "up": up})

    # ---- The connection, in the client's own thread

    def _made(self, password: Secret | None) -> "Client":
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        client = Client(CallbackAPIVersion.VERSION2)
        client.reconnect_delay_set(*_RETRY_S)
        if self._broker.user:
            client.username_pw_set(self._broker.user, password.reveal() if password else None)
        if self._broker.secure:
            client.tls_set()  # the system's authorities; the name is checked
        client.will_set(self._agent_topic, self._agent(up=False), qos=1, retain=True)
        client.on_connect = self._on_connect
        client.on_connect_fail = self._on_connect_fail
        client.on_disconnect = self._on_disconnect
        return client

    def _on_connect(
        self, _client: object, _data: object, _flags: object, code: "ReasonCode", _: object
    ) -> None:
        if code.is_failure:
            self._say(tr("The broker {url} refuses: {why}.", url=self._broker.url, why=code))
            return
        self._trouble = self._publisher = ""
        self._lost.set()
        self._connected.set()

    def _on_connect_fail(self, _client: object, _data: object) -> None:
        silent = tr("The broker {url} does not answer; it is tried again.", url=self._broker.url)
        if self._broker.secure:  # the client does not say which of the two it was
            silent = tr(
                "The broker {url} does not answer, or its certificate is not valid for this "
                "computer; it is tried again.",
                url=self._broker.url,
            )
        self._say(silent)

    def _on_disconnect(self, *_: object) -> None:
        self._connected.clear()

    def _say(self, trouble: str) -> None:
        if trouble != self._trouble:
            self._tell(trouble)
        self._trouble = trouble


def _plan(plan: PlanSummary) -> Mapping[str, object]:
    return {
        "plan": plan.id,
        "kind": plan.kind,
        "name": plan.name,
        "made_at": plan.made_at,
        "finished": plan.finished,
        "cancelled_at": plan.cancelled_at or None,
        "states": {str(state): plan.counts.get(state, 0) for state in JobState},
        "halts": [
            {
                "number": halt.number,
                "at": halt.at,
                "rule": str(halt.rule),
                "cell": halt.cell or None,
            }
            for halt in plan.standing
        ],
    }


def _name_of(broker: MqttBroker) -> str:
    """Return what the position of a broker, and the lock of who publishes there, is called."""
    return f"mqtt {broker.host}:{broker.port}/{broker.prefix}"


def _level(name: str) -> str:
    """Return a name as one level of a topic."""
    return quote(name, safe="")


def _text(document: Mapping[str, object]) -> str:
    return json.dumps(document, sort_keys=True, ensure_ascii=False)
