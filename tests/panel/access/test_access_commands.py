"""panel pin, tablets and cert, and what the panel does with a certificate."""

import json
import ssl
import stat
from datetime import timedelta

import click
import pytest
from robolink_cli import main
from robolink_cli.commands.computer import panel, panel_access
from robolink_cli.console.person import Person, person_at
from robolink_cli.panel.guard import tls
from robolink_cli.panel.guard.pairing import PairedTablets
from robolink_cli.panel.guard.people import NOBODY, Pins

from robolink.errors import ConfigError, DeclinedError
from robolink.timing import wall_time
from tests.panel.access._bare import MEI, PINS

CELLS = """
[cells.line3]
url = "epson+tcp://192.0.2.1:5000"
people = { mei = "engineer", jon = "operator" }
"""

pytestmark = pytest.mark.usefixtures("state_folder")


@pytest.fixture(autouse=True)
def cells(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text(CELLS)


@pytest.fixture
def pin_file(tmp_path):
    path = tmp_path / "pin"
    path.write_text(PINS[MEI] + "\n")
    path.chmod(0o600)
    return path


def test_a_pin_from_a_file_that_only_its_owner_reads(pin_file, capsys):
    assert main.run(["panel", "pin", "mei", "--pin-file", str(pin_file)]) == 0
    assert Pins().matches(MEI, PINS[MEI])
    assert not Pins().matches(NOBODY, PINS[MEI])
    pin_file.chmod(0o644)
    assert main.run(["panel", "pin", "mei", "--pin-file", str(pin_file)]) == 2
    assert "chmod 600" in capsys.readouterr().err
    assert main.run(["--json", "panel", "pin", "mei", "--remove"]) == 0
    assert json.loads(capsys.readouterr().out)["set"] is False
    assert Pins().mark(MEI) == ""


def test_a_pin_is_typed_unseen_and_twice(monkeypatch, capsys):
    typed = [PINS[MEI], PINS[MEI], PINS[MEI], "8" + PINS[MEI]]
    asked = []

    def prompt(text, **options):
        asked.append(options["hide_input"])
        return typed.pop(0)

    monkeypatch.setattr(click, "prompt", prompt)
    with person_at(Person.TERMINAL):
        assert main.run(["panel", "pin"]) == 0
        assert Pins().matches(NOBODY, PINS[MEI])
        before = Pins().mark(NOBODY)
        assert main.run(["panel", "pin"]) == 2
    assert asked == [True] * 4
    assert Pins().mark(NOBODY) == before
    said = capsys.readouterr()
    assert PINS[MEI] not in said.out + said.err


def test_nobody_at_a_page_sets_one(capsys):
    assert main.run(["panel", "pin", "mei"]) == 9
    assert "--pin-file" in capsys.readouterr().err
    with person_at(Person.WIRE), pytest.raises(DeclinedError):
        panel_access._typed(None)


def test_whose_it_may_be(pin_file, capsys):
    assert main.run(["panel", "pin", "mie", "--pin-file", str(pin_file)]) == 2
    assert "mei" in capsys.readouterr().err
    (pin_file.parent / "robolink.toml").write_text('[cells.a]\nurl = "epson+tcp://192.0.2.1"\n')
    assert main.run(["panel", "pin", "mei", "--pin-file", str(pin_file)]) == 2
    assert "leave NAME out" in " ".join(capsys.readouterr().err.split())
    pin_file.write_text("1234567")
    assert main.run(["panel", "pin", "--pin-file", str(pin_file)]) == 2
    pin_file.write_bytes(b"\xff" * 8)
    assert main.run(["panel", "pin", "--pin-file", str(pin_file)]) == 2
    assert Pins().mark(NOBODY) == ""


def test_tablets_are_listed_and_forgotten(capsys):
    assert main.run(["panel", "tablets"]) == 0
    assert "No tablet" in capsys.readouterr().out
    PairedTablets().pair(MEI, "192.0.2.7")
    PairedTablets().pair("", "192.0.2.8")
    assert main.run(["--json", "panel", "tablets"]) == 0
    (one, two) = json.loads(capsys.readouterr().out)["tablets"]
    assert {one["address"], two["address"]} == {"192.0.2.7", "192.0.2.8"}
    assert main.run(["panel", "tablets", "--forget", one["id"]]) == 0
    assert one["id"] not in capsys.readouterr().out
    assert main.run(["panel", "tablets", "--forget", one["id"]]) == 2
    assert [tablet.id for tablet in PairedTablets().all()] == [two["id"]]


def test_a_certificate_is_made_once_and_says_what_a_tablet_shows(capsys):
    assert main.run(["panel", "cert", "--show"]) == 2
    assert main.run(["panel", "cert", "--name", "Cell.shop", "--name", "192.0.2.5"]) == 0
    said = capsys.readouterr().out
    path, key = tls.own_files()
    made = tls.load(path, key)
    assert made.names == ("cell.shop", "192.0.2.5")
    assert made.fingerprint in said
    assert stat.S_IMODE(key.stat().st_mode) == 0o600
    assert main.run(["panel", "cert"]) == 2
    assert tls.load(path, key).fingerprint == made.fingerprint
    assert main.run(["panel", "cert", "--replace"]) == 0
    assert tls.load(path, key).fingerprint != made.fingerprint
    capsys.readouterr()
    assert main.run(["--json", "panel", "cert", "--show"]) == 0
    assert "localhost" in json.loads(capsys.readouterr().out)["names"]


@pytest.mark.parametrize("name", ["a b", "-a", "a..b", "a/b", "x" * 64, "", "*.shop", "\u4e2d"])
def test_what_is_no_name_gets_no_certificate(name):
    with pytest.raises(ConfigError):
        tls.make((name,))
    assert not tls.own_files()[0].exists()


def test_a_certificate_that_cannot_be_used_is_refused_by_name(tmp_path, monkeypatch):
    made = tls.make(("cell.shop",))
    path, key = made.path, made.key
    key.chmod(0o640)
    with pytest.raises(ConfigError, match="Others than"):
        tls.load(path, key)
    key.chmod(0o600)
    for wrong, why in ((tmp_path / "missing", "missing"), (key, "no PEM")):
        with pytest.raises(ConfigError, match=why):
            tls.load(wrong, key)
    other = tmp_path / "other.pem"
    other.write_bytes(key.read_bytes())
    other.chmod(0o600)
    tls.make(("cell.shop",), replace=True)
    with pytest.raises(ConfigError, match="make no TLS"):
        tls.load(path, other)
    for days in (-1, tls.VALID_DAYS + 1):
        shifted = wall_time() + timedelta(days=days)
        monkeypatch.setattr(tls, "wall_time", lambda shifted=shifted: shifted)
        with pytest.raises(ConfigError, match="counts from"):
            tls.load(path, key)
        monkeypatch.undo()


def test_another_address_needs_tls(tmp_path, capsys):
    assert main.run(["panel", "--listen", "0.0.0.0:0"]) == 2
    assert "robolink panel cert" in capsys.readouterr().err
    own = tls.make(("cell.shop",))
    place, names = panel._place("0.0.0.0", 0, None, None)
    assert (place.certificate, place.key) == (str(own.path), str(own.key))
    assert names == ("cell.shop",)
    assert panel._place("127.0.0.1", 0, None, None)[0].certificate == ""
    with pytest.raises(click.UsageError):
        panel._place("127.0.0.1", 0, own.path, None)


def test_tls_is_served_and_nothing_older(tmp_path):
    made = tls.make(("localhost",))
    served = tls.context(made.path, made.key)
    assert served.minimum_version is ssl.TLSVersion.TLSv1_2
    trusts = ssl.create_default_context(cafile=str(made.path))
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = trusts.wrap_bio(incoming, outgoing, server_hostname="localhost")
    server = served.wrap_bio(outgoing, incoming, server_side=True)
    for _ in range(4):
        for end in (client, server):
            try:
                end.do_handshake()
            except ssl.SSLWantReadError:
                continue
    assert client.version() == "TLSv1.3"
    said = client.getpeercert() or {}
    assert said["subjectAltName"] == (("DNS", "localhost"),)
