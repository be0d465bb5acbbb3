"""What a plant tells a real broker: states, and each event in order, whatever stops in between."""

import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, suppress
from types import SimpleNamespace

import pytest
from robolink_cli.commands.fleet.agent import unit

from robolink.errors import ConfigError, LeaseHeldError
from robolink.fleet import CellState, FleetStore, PlantNotes
from robolink.fleet.agent_lock import AgentLock
from robolink.fleet.plant_view import mqtt_feed
from robolink.fleet.plant_view.mqtt_feed import MqttFeed, broker_of, publisher_lock
from robolink.model import Secret
from tests._documents import wrong_in
from tests.fleet._broker import NEEDED, Broker, Listener
from tests.fleet._plans import carried_out, cells_of, permitted, plan_with

PLAN = "robots/plant/plans/"


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(mqtt_feed, "EVERY_S", 0.02)
    monkeypatch.setattr(mqtt_feed, "_RETRY_S", (0.05, 0.05))


@pytest.fixture
def stack():
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def broker(tmp_path, stack):
    broker = Broker(tmp_path).start()
    stack.callback(lambda: broker.stop())
    return broker


def listener(stack, broker):
    found = Listener(broker)
    stack.callback(found.close)
    return found


@pytest.fixture
def told():
    return []


@pytest.fixture
def feed(location, told, stack):
    """Starts a feed; what is returned ends it."""

    def start(broker, **more):
        notes = stack.enter_context(PlantNotes(location, "plant"))
        feed = MqttFeed(broker_of(broker.url), notes, "plant", tell=told.append, **more)
        running = stack.enter_context(ExitStack())
        running.enter_context(feed.running())
        return running.close

    return start


def ended(location, wall, plan, numbers):
    with FleetStore(location, clock=wall) as store:
        for number in numbers:
            carried_out(store, plan, cells_of(number)[-1])


def planned(location, wall, count=6):
    with FleetStore(location, clock=wall) as store:
        return permitted(store, plan_with(count, kind="check"))


@NEEDED
def test_states_are_retained_and_each_end_is_told_in_order(broker, feed, stack, location, wall):
    plan = planned(location, wall)
    with PlantNotes(location, "plant", clock=wall) as notes:
        notes.note({"line3/a +": CellState("epson:C-1/R-1", changes={"done": 2})}, {})
    end = feed(broker)
    heard = listener(stack, broker).until(lambda one: f"{PLAN}{plan.id}" in one.retained)
    heard.until(lambda one: "robots/plant/cells/line3%2Fa%20%2B" in one.retained)
    ended(location, wall, plan, (1, 2))
    with FleetStore(location, clock=wall) as store:
        store.halt(plan.id, "Li", "the line stands")
        store.resume(plan.id, "Chen", "looked at")
    heard.until(lambda one: len(one.events) == 4)
    assert [one["event"] for one in heard.events] == ["outcome", "outcome", "halt", "resumed"]
    assert [one["number"] for one in heard.events] == [1, 2, 3, 4]
    assert [one["state"] for one in heard.events[:2]] == ["kept", "kept"]
    heard.until(lambda one: one.retained[f"{PLAN}{plan.id}"]["states"]["kept"] == 2)
    late = listener(stack, broker).until(lambda one: len(one.retained) == 3)
    assert late.events == []  # events are not retained
    assert late.retained["robots/plant/agent"]["up"] is True
    for document in (*late.retained.values(), *heard.events):
        assert wrong_in(document) == []
    end()
    heard.until(lambda one: one.retained["robots/plant/agent"]["up"] is False)


@NEEDED
def test_a_broker_that_was_away_hears_everything_in_order(
    broker, feed, stack, location, wall, told
):
    plan = planned(location, wall)
    end = feed(broker)
    first = listener(stack, broker)
    first.until(lambda one: one.retained.get("robots/plant/agent", {}).get("up"))
    ended(location, wall, plan, (1,))
    first.until(lambda one: len(one.events) == 1)
    broker.stop()
    ended(location, wall, plan, (2, 3))
    end()  # the agent ends too, while the broker is away
    ended(location, wall, plan, (4,))
    feed(broker)
    ended(location, wall, plan, (5,))
    until = time.monotonic() + 20
    while not told and time.monotonic() < until:
        time.sleep(0.01)
    assert "does not answer" in told[0]
    broker.start()
    heard = listener(stack, broker).until(lambda one: f"{PLAN}{plan.id}" in one.retained)
    ended(location, wall, plan, (6,))
    heard.until(lambda one: one.events and one.events[-1]["number"] == 6)
    with PlantNotes(location, "plant") as notes:
        assert [number for number, _ in notes.events(0)] == [1, 2, 3, 4, 5, 6]
        until = time.monotonic() + 20
        while notes.position(f"mqtt 127.0.0.1:{broker.port}/robots") != ("", 6):
            assert time.monotonic() < until
            time.sleep(0.01)
    # Who listened too late to hear the first of them heard the rest without a gap.
    got = [one["number"] for one in heard.events]
    assert got == list(range(got[0], 7))
    assert heard.retained["robots/plant/agent"]["up"] is True


@NEEDED
def test_what_a_broker_did_not_acknowledge_is_delivered_by_the_next_agent(
    broker, feed, stack, location, wall
):
    plan = planned(location, wall)
    end = feed(broker)
    heard = listener(stack, broker)
    heard.until(lambda one: one.retained.get("robots/plant/agent", {}).get("up"))
    end()
    heard.until(lambda one: not one.retained["robots/plant/agent"]["up"])
    ended(location, wall, plan, (1, 2, 3))
    feed(broker)
    heard.until(lambda one: [event["number"] for event in one.events] == [1, 2, 3])


PUBLISHER = """
import sys
from robolink.fleet import PlantNotes
from robolink.fleet.plant_view.mqtt_feed import MqttFeed, broker_of, publisher_lock
location, broker = sys.argv[1], broker_of(sys.argv[2])
lock = publisher_lock(location, "plant", broker)
with PlantNotes(location, "plant") as notes, MqttFeed(broker, notes, "plant", lock=lock).running():
    sys.stdin.read()
"""


@NEEDED
@pytest.mark.soak
@pytest.mark.parametrize("location", ["postgresql"], indirect=True)
@pytest.mark.parametrize("ends", ["in order", "killed"])
def test_of_two_agents_one_publishes_and_the_other_goes_on_when_it_is_gone(
    broker, feed, stack, location, wall, told, ends
):
    plan = planned(location, wall)
    heard = listener(stack, broker)
    command = [sys.executable, "-m", "tests._program", PUBLISHER, location, broker.url]
    first = stack.enter_context(subprocess.Popen(command, stdin=subprocess.PIPE, text=True))
    stack.callback(first.kill)
    heard.until(lambda them: them.retained.get("robots/plant/agent", {}).get("up"))
    lock = publisher_lock(location, "plant", broker_of(broker.url))
    assert lock is not None
    feed(broker, lock=lock)
    eventually(lambda: told)
    assert f" {first.pid} publishes to the broker {broker.url}." in told[0]
    ended(location, wall, plan, (1, 2))
    heard.until(lambda them: len(them.events) == 2)
    assert not lock.is_held()
    if ends == "in order":
        first.communicate(timeout=20)
    else:
        first.kill()
    assert first.wait(20) == (0 if ends == "in order" else -signal.SIGKILL)
    ended(location, wall, plan, (3, 4))
    heard.until(lambda them: them.events[-1]["number"] == 4)
    heard.until(lambda them: them.retained["robots/plant/agent"]["up"])
    heard.until(lambda them: them.retained[f"{PLAN}{plan.id}"]["states"]["kept"] == 4)
    numbers = [event["number"] for event in heard.events]
    # Without a gap; what the first did not note as acknowledged comes twice.
    assert numbers[:2] == [1, 2]
    assert numbers[2:] == list(range(numbers[2], 5))


@NEEDED
def test_who_loses_the_broker_lets_another_publish_and_says_once_who_does(
    broker, feed, stack, location, wall, told, tmp_path, monkeypatch
):
    """Two brokers stand for one that the first agent reaches no more, and the second does."""
    asked: list[str] = []
    taken: list[str] = []
    now_s = 0.0
    time_of_the_feed = SimpleNamespace(monotonic_ns=lambda: int(now_s * 1e9))
    monkeypatch.setattr(mqtt_feed, "runtime", time_of_the_feed)

    def lock_of(name):
        def take():
            try:
                AgentLock.take(lock)
                taken.append(name)
            finally:
                asked.append(name)

        lock = AgentLock(location, "plant", "broker")
        monkeypatch.setattr(lock, "take", take)
        return lock

    def asks_again_at(second_s):
        nonlocal now_s
        before, now_s = asked.count("second"), second_s
        eventually(lambda: asked.count("second") > before)

    plan = planned(location, wall)
    (tmp_path / "other").mkdir()
    away = Broker(tmp_path / "other").start()
    stack.callback(lambda: away.stop())
    with AgentLock(location, "plant", "broker"):
        feed(away, lock=lock_of("first"))
        eventually(lambda: told)
    now_s = 5.5
    heard = listener(stack, away)
    heard.until(lambda them: them.retained.get("robots/plant/agent", {}).get("up"))
    second_ends = feed(broker, lock=lock_of("second"))
    eventually(lambda: len(told) == 2)
    asks_again_at(100.0)
    for number in (1, 2):  # who is connected goes on for however long
        ended(location, wall, plan, (number,))
        heard.until(lambda them, number=number: len(them.events) == number)
    assert taken == ["first"]
    assert len(asked) == 4, "the lock of another agent is asked for without a pause"
    away.stop()
    eventually(lambda: len(told) == 3)
    asks_again_at(159.0)
    assert taken == ["first"]
    now_s = 161.0  # the first gives the lock up, and the second asks for it before the first does
    following = AgentLock(location, "plant", "broker")
    eventually(lambda: is_free(following))
    asks_again_at(164.5)
    heard = listener(stack, broker)
    heard.until(lambda them: them.retained.get("robots/plant/agent", {}).get("up"))
    assert taken == ["first", "second"]
    now_s = 172.0
    eventually(lambda: len(told) == 4)
    now_s = 178.0
    eventually(lambda: asked[-2:] == ["first", "first"])
    second_ends()
    now_s = 184.0
    eventually(lambda: taken[2:] == ["first"])
    away.start()
    heard = listener(stack, away)
    heard.until(lambda them: them.retained.get("robots/plant/agent", {}).get("up"))
    assert [sentence.count(" publishes to the broker ") for sentence in told] == [1, 1, 0, 1]
    assert f" publishes to the broker {away.url}." in told[3]
    assert "does not answer" in told[2]


def is_free(lock):
    try:
        with lock:
            return True
    except LeaseHeldError:
        return False


@NEEDED
def test_a_login_that_is_refused_is_told_and_shows_no_password(tmp_path, stack, feed, told):
    broker = Broker(tmp_path, anybody=False).start()
    stack.callback(broker.stop)
    named = broker_of(f"mqtt://line@127.0.0.1:{broker.port}/robots")
    feed(type("Named", (), {"url": named.url}), password=Secret("w0ng-secret"))
    until = time.monotonic() + 20
    while not told and time.monotonic() < until:
        time.sleep(0.01)
    assert len(told) == 1
    assert "refuses" in told[0]
    assert "w0ng-secret" not in told[0]


class Pushing:
    """A broker that accepts everything and pushes commands that nobody subscribed to."""

    def __init__(self):
        self.server = socket.create_server(("127.0.0.1", 0))
        self.url = f"mqtt://127.0.0.1:{self.server.getsockname()[1]}/robots"
        self.kinds = []
        self.connect = b""
        self.published = []
        self.pushed = threading.Event()
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        with suppress(OSError):  # it hangs up when it ends
            self._speak()

    def _speak(self):
        with self.server, self.server.accept()[0] as peer, peer.makefile("rb") as stream:
            while head := stream.read(1):
                body, kind = stream.read(self._length(stream)), head[0] >> 4
                self.kinds.append(kind)
                if kind == 1:
                    self.connect = body
                    peer.sendall(b"\x20\x02\x00\x00")
                elif kind == 3:
                    topic = struct.unpack(">H", body[:2])[0]
                    said = body[4 + topic :] != b""
                    self.published.append((body[2 : 2 + topic].decode(), said))
                    peer.sendall(b"\x40\x02" + body[2 + topic : 4 + topic])
                    for name in (b"robots/plant/agent", b"robots/plant/plans/x/resume"):
                        push = struct.pack(">H", len(name)) + name + b"\x00\x07" + b"{}"
                        peer.sendall(bytes([0x32, len(push)]) + push)
                    self.pushed.set()

    @staticmethod
    def _length(stream):
        value, shift = 0, 0
        while True:
            byte = stream.read(1)[0]
            value |= (byte & 0x7F) << shift
            shift += 7
            if not byte & 0x80:
                return value


def eventually(holds, within_s=20):
    until_s = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < until_s, "it did not come to pass"
        time.sleep(0.01)


def test_each_of_many_states_that_are_gone_is_cleared(feed, location, monkeypatch):
    monkeypatch.setattr(mqtt_feed, "AT_ONCE", 1)
    topics = [f"robots/plant/cells/{cell}" for cell in "abc"]
    with PlantNotes(location, "plant") as notes:
        notes.note(dict.fromkeys("abc", CellState()), {})
        broker = Pushing()
        end = feed(broker)
        eventually(lambda: {(topic, True) for topic in topics} <= set(broker.published))
        with notes._database.transaction() as database:
            database.run("DELETE FROM cell_states WHERE cell <> 'c'")
        eventually(lambda: {(topic, False) for topic in topics[:2]} <= set(broker.published))
    end()
    assert (topics[2], False) not in broker.published


def test_a_defect_is_told_and_ends_no_later_step(feed, location, told, monkeypatch):
    look = PlantNotes.look

    def failing(notes):
        monkeypatch.setattr(PlantNotes, "look", look)
        return 1 // 0

    monkeypatch.setattr(PlantNotes, "look", failing)
    broker = Pushing()
    end = feed(broker)
    eventually(lambda: ("robots/plant/agent", True) in broker.published)
    end()
    assert told == ["A defect in robolink: ZeroDivisionError: integer division or modulo by zero"]


def test_an_event_waits_for_no_number_of_states(feed, location, wall, monkeypatch):
    monkeypatch.setattr(mqtt_feed, "AT_ONCE", 1)
    plan = planned(location, wall)
    broker = Pushing()
    with PlantNotes(location, "plant", clock=wall) as notes:
        notes.note({}, {f"mqtt 127.0.0.1:{broker.url[17:-7]}/robots": ("", notes.last_event())})
        notes.note(dict.fromkeys("abc", CellState()), {})
    with FleetStore(location, clock=wall) as store:
        store.halt(plan.id, "Li", "the line stands")
    end = feed(broker)
    eventually(lambda: broker.published)
    end()
    assert broker.published[0] == ("robots/plant/events", True)


def test_nothing_comes_in(feed, location, wall):
    plan = planned(location, wall)
    with FleetStore(location, clock=wall) as store:
        store.halt(plan.id, "Li", "the line stands")
        before = store.progress(plan.id)
    broker = Pushing()
    end = feed(broker)
    assert broker.pushed.wait(20)
    end()
    assert set(broker.kinds) <= {1, 3, 4, 12, 14}  # connect, publish, acknowledge, ping, disconnect
    assert 8 not in broker.kinds  # never subscribe
    # The last will: retained, with QoS 1, it says that the agent is gone.
    assert broker.connect[7] & 0b00111100 == 0b00101100
    assert b"robots/plant/agent" in broker.connect
    assert b'"up": false' in broker.connect
    with FleetStore(location, clock=wall) as store:
        assert store.progress(plan.id) == before


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("mqtts://line:secret-word@broker/p", "password"),
        ("mqtt://broker.plant/p", "unencrypted"),
        ("http://broker/p", "not the URL"),
        ("mqtts://broker/p/+/x", "Topics"),
        ("mqtts://broker/p?x=1", "not the URL"),
        ("mqtts://:99999999/p", "not the URL"),
    ],
)
def test_a_broker_that_cannot_be_meant_is_refused(url, says):
    with pytest.raises(ConfigError, match=says) as refused:
        broker_of(url)
    assert "secret-word" not in str(refused.value)


def test_only_this_computer_or_a_named_one_is_reached_without_tls():
    assert broker_of("mqtt://127.0.0.1/p").port == 1883
    assert broker_of("mqtt://localhost").prefix == "robolink"
    assert broker_of("mqtt://broker.plant/p", plain_host="broker.plant").secure is False
    with pytest.raises(ConfigError):
        broker_of("mqtt://broker.plant/p", plain_host="other.plant")


def test_a_unit_of_systemd_goes_on_serving_and_publishing(monkeypatch):
    monkeypatch.setenv("ROBOLINK_MQTT_PASSWORD_FILE", "/etc/robolink/broker")
    said = {"--metrics": "9469", "--mqtt": "mqtts://line@broker/p", "--mqtt-plain": ""}
    text = unit("plant", None, said)
    assert "fleet agent plant --metrics 9469 --mqtt mqtts://line@broker/p\n" in text
    assert 'Environment="ROBOLINK_MQTT_PASSWORD_FILE=/etc/robolink/broker"' in text


@pytest.mark.parametrize("url", ["mqtts://line:secret-7@broker/p", "mqtt://broker/p"])
def test_no_unit_shows_a_password_or_names_a_broker_that_its_agent_refuses(url):
    with pytest.raises(ConfigError) as refused:
        unit("plant", None, {"--mqtt": url, "--mqtt-plain": ""})
    assert "secret-7" not in str(refused.value)
