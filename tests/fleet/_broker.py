"""A real MQTT broker, Mosquitto, on loopback, and somebody who listens to it."""

import json
import shutil
import socket
import subprocess
import threading
import time
from pathlib import Path

import pytest
from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion

from tests._ports import free_port

MOSQUITTO = shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:/usr/bin:/usr/local/bin")
NEEDED = pytest.mark.skipif(MOSQUITTO is None, reason="mosquitto (a Debian package) is missing")


class Broker:
    """A broker that a test starts and stops; it forgets everything at each start."""

    def __init__(self, folder: Path, *, anybody: bool = True):
        self.port = free_port()
        self.file = folder / "mosquitto.conf"
        said = f"listener {self.port} 127.0.0.1\npersistence false\n"
        said += f"allow_anonymous {'true' if anybody else 'false'}\n"
        self.file.write_text(said)

    @property
    def url(self):
        return f"mqtt://127.0.0.1:{self.port}/robots"

    def start(self):
        self._begin()
        until = time.monotonic() + 20
        while True:
            try:
                socket.create_connection(("127.0.0.1", self.port), timeout=1).close()
            except OSError:
                assert time.monotonic() < until, "the broker did not start"
                assert self.process.poll() is None, "it ended at once"
                time.sleep(0.01)
            else:
                return self

    def _begin(self):
        command = [str(MOSQUITTO), "-c", str(self.file)]
        self.process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def stop(self):
        self.process.kill()
        self.process.wait()


class Listener:
    """Who subscribes to everything: retained documents by topic, and all events in order."""

    def __init__(self, broker):
        self.retained, self.events = {}, []
        self._news = threading.Condition()
        self._client = Client(CallbackAPIVersion.VERSION2)
        self._client.on_message = self._heard
        self._client.on_connect = lambda client, *_: client.subscribe("#", qos=1)
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()

    def _heard(self, _client, _data, message):
        with self._news:
            said = json.loads(message.payload) if message.payload else None
            if message.topic.endswith("/events"):
                self.events.append(said)
            else:
                self.retained[message.topic] = said
            self._news.notify_all()

    def until(self, true, within_s=20):
        with self._news:
            assert self._news.wait_for(lambda: true(self), within_s), (self.retained, self.events)
        return self

    def close(self):
        self._client.disconnect()
        self._client.loop_stop()
