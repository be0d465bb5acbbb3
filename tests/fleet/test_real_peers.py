"""What a plant's agent meets there: systemd, a broker with TLS, Prometheus; each the real one.

Debian's packages ``systemd``, ``mosquitto`` and ``prometheus``; each test that lacks its own says
so.
"""

import json
import os
import shutil
import subprocess
import time
from contextlib import ExitStack
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from urllib.error import URLError
from urllib.parse import urlencode
from urllib.request import urlopen

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from robolink_cli.commands.fleet.agent import unit

from robolink.fleet import CellState, PlantNotes
from robolink.fleet.plant_view import mqtt_feed
from robolink.fleet.plant_view.metrics import PlantMetrics, metrics_served
from robolink.fleet.plant_view.mqtt_feed import MqttFeed, broker_of
from tests._ports import free_port
from tests.fleet._broker import NEEDED, Broker, Listener

pytestmark = pytest.mark.soak


def needs(program):
    """A test that is skipped where a program is missing."""
    lacks = shutil.which(program) is None
    return pytest.mark.skipif(lacks, reason=f"{program} (of a Debian package) is missing")


def eventually(holds, within_s=30):
    until_s = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < until_s, "it did not come to pass"
        time.sleep(0.05)


# ---- systemd


@needs("systemd-analyze")
def test_systemd_takes_the_unit_of_an_agent(tmp_path, monkeypatch):
    plant, cells = tmp_path / "plant 100%.db", tmp_path / "cells.toml"
    monkeypatch.setenv("ROBOLINK_PLANT", str(plant))
    monkeypatch.setenv("ROBOLINK_CONFIG", str(cells))
    outward = {"--metrics": "9469", "--mqtt": "mqtts://line@broker/p", "--mqtt-plain": ""}
    text = unit("plant", tmp_path / "back ups", outward)
    assert verified(tmp_path, text) == ""
    wrong = verified(tmp_path, text.replace("WatchdogSec", "WatchdogSecs"))
    assert "WatchdogSecs" in wrong  # the judge would have said so


def verified(folder, text):
    file = folder / "robolink-fleet.service"
    file.write_text(text)
    line = ["systemd-analyze", "verify", "--man=no", str(file)]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=60)
    said = done.stdout + done.stderr
    return said or ("" if done.returncode == 0 else f"exit code {done.returncode}")


# ---- a broker with TLS


class Authority:
    """An authority of this test, and a certificate of it for a broker."""

    def __init__(self, folder, name):
        self.file, self._key = folder / "authority.pem", ec.generate_private_key(ec.SECP256R1())
        self._subject = _named("an authority of a test")
        whole = self._signed(self._subject, self._key.public_key(), x509.BasicConstraints(True, 0))
        self.file.write_bytes(whole.public_bytes(serialization.Encoding.PEM))
        key = ec.generate_private_key(ec.SECP256R1())
        names = x509.SubjectAlternativeName([x509.IPAddress(ip_address(name))])
        of_broker = self._signed(_named("broker"), key.public_key(), names)
        self.certificate, self.key = folder / "broker.pem", folder / "broker.key"
        self.certificate.write_bytes(of_broker.public_bytes(serialization.Encoding.PEM))
        self.key.write_bytes(
            key.private_bytes(
                serialization.Encoding.PEM,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            )
        )

    def _signed(self, subject, public, extension):
        now = datetime.now(UTC)
        made = (
            x509.CertificateBuilder()
            .subject_name(subject)
            .issuer_name(self._subject)
            .public_key(public)
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - timedelta(days=1))
            .not_valid_after(now + timedelta(days=1))
            .add_extension(extension, critical=True)
        )
        return made.sign(self._key, hashes.SHA256())


def _named(name):
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


class TlsBroker(Broker):
    """A broker that is reached over TLS, and on another port without, by whoever listens."""

    def __init__(self, folder, authority):
        super().__init__(folder)
        self.tls_port = free_port()
        with self.file.open("a") as settings:
            settings.write(
                f"listener {self.tls_port} 127.0.0.1\n"
                f"certfile {authority.certificate}\nkeyfile {authority.key}\n"
            )
            if os.geteuid() == 0:  # else it becomes another user, who may not read the key
                settings.write("user root\n")

    @property
    def tls_url(self):
        return f"mqtts://127.0.0.1:{self.tls_port}/robots"


@pytest.fixture
def stack():
    with ExitStack() as stack:
        yield stack


@NEEDED
@pytest.mark.filterwarnings("ignore:unclosed <ssl.SSLSocket:ResourceWarning")  # of paho's
@pytest.mark.parametrize(
    ("name", "known", "heard"),
    [("127.0.0.1", True, True), ("127.0.0.1", False, False), ("127.0.0.2", True, False)],
    ids=["right", "unknown authority", "another host"],
)
def test_a_broker_over_tls_hears_the_plant_if_its_certificate_is_right(
    tmp_path, monkeypatch, stack, name, known, heard
):
    monkeypatch.setattr(mqtt_feed, "EVERY_S", 0.02)
    monkeypatch.setattr(mqtt_feed, "_RETRY_S", (0.05, 0.05))
    authority = Authority(tmp_path, name)
    broker = TlsBroker(tmp_path, authority).start()
    stack.callback(broker.stop)
    listener = Listener(broker)
    stack.callback(listener.close)
    nobody = tmp_path / "nobody.pem"
    nobody.touch()
    monkeypatch.setenv("SSL_CERT_FILE", str(authority.file if known else nobody))
    monkeypatch.setenv("SSL_CERT_DIR", str(tmp_path / "none"))
    notes = stack.enter_context(PlantNotes(str(tmp_path / "plant.db"), "plant"))
    notes.note({"line3-a": CellState("epson:C-1/R-1")}, {})
    told: list[str] = []
    stack.enter_context(
        MqttFeed(broker_of(broker.tls_url), notes, "plant", tell=told.append).running()
    )
    if heard:
        listener.until(lambda one: "robots/plant/cells/line3-a" in one.retained)
        assert told == []
    else:
        eventually(lambda: told)
        assert "certificate" in told[0]
        assert listener.retained == {}


# ---- Prometheus


class Prometheus:
    """Prometheus with one job, asked over its own interface."""

    def __init__(self, folder, target):
        self._port, settings = free_port(), folder / "prometheus.json"
        scrape = {"job_name": "robolink", "static_configs": [{"targets": [target]}]}
        settings.write_text(  # JSON is YAML
            json.dumps({"global": {"scrape_interval": "1s"}, "scrape_configs": [scrape]})
        )
        self._command = [
            *("prometheus", f"--config.file={settings}", f"--storage.tsdb.path={folder / 'data'}"),
            f"--web.listen-address=127.0.0.1:{self._port}",
        ]
        self._log = folder / "prometheus.log"

    def __enter__(self):
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(self._command, stdout=log, stderr=log)
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()

    def asked(self, query):
        """Return the values of a query by their labels; nothing before it answers."""
        url = f"http://127.0.0.1:{self._port}/api/v1/query?{urlencode({'query': query})}"
        try:
            with urlopen(url, timeout=10) as answer:
                found = json.load(answer)["data"]["result"]
        except (URLError, ConnectionError):
            assert self._process.poll() is None, self._log.read_text()
            return {}
        return {
            tuple(
                value for name, value in sorted(one["metric"].items()) if name[:2] != "__"
            ): float(one["value"][1])
            for one in found
        }


def _labels(metric):
    return tuple(value for name, value in sorted(metric.items()) if not name.startswith("__"))


@needs("prometheus")
def test_prometheus_scrapes_the_metrics_of_a_plant(tmp_path, stack):
    notes = stack.enter_context(PlantNotes(str(tmp_path / "plant.db"), "plant"))
    begun = "2026-11-30T20:00:00+00:00"
    notes.note({"a": CellState("epson:C-1/R-1", unsettled_since=begun), "b": CellState()}, {})
    metrics = PlantMetrics(notes.look, time.time)
    url = stack.enter_context(metrics_served("127.0.0.1", 0, metrics))
    target = url.partition("://")[2].partition("/")[0]
    prometheus = stack.enter_context(Prometheus(tmp_path, target))
    eventually(lambda: prometheus.asked("robolink_plant_up").values(), within_s=60)
    assert [*prometheus.asked('up{job="robolink"}').values()] == [1.0]
    unsettled = prometheus.asked("sum by (cell) (robolink_unsettled)")
    assert unsettled == {("a",): 1.0, ("b",): 0.0}
    assert prometheus.asked("robolink_unsettled > 0")  # as the alert of the page asks
    assert [*prometheus.asked("robolink_check_age_seconds").values()] == [float("inf")] * 2
