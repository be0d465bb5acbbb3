"""Whom robolink believes over OPC UA, and what it sends before it does; real servers."""

import json
import socket
import threading
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import timedelta

import pytest
import robolink_cli.commands.computer.certificates as commands
from robolink_cli import main
from robolink_cli.commands.fleet.acts import CellActs
from robolink_cli.console.person import Person
from robolink_simulators.hosting.fieldbus import opcua_certificate
from robolink_simulators.hosting.fieldbus.opcua import serve_opcua
from robolink_simulators.plc import PlcSimulator, serve_plc_opcua
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
from robolink_simulators.testkit.operator import written_symbol_map

import robolink
from robolink import config
from robolink.config import connect_cell, find_cell
from robolink.controllers import stop_now
from robolink.errors import (
    ConfigError,
    LoginRefusedError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportError,
)
from robolink.fleet import plan_of
from robolink.journal import memory_journal
from robolink.model import MotionProfile, Path, Secret, WorkBox
from robolink.register_maps import load_symbol_map
from robolink.timing import wall_time
from robolink.transport import open_mailbox_link, parse_url
from robolink.transport.opcua import own_certificate as own
from robolink.transport.opcua import server_certificate as shown
from robolink.transport.opcua.opening import ask_certificate
from tests.contract._terminal import Terminal
from tests.unit._scripted_opcua import told_error

USER, PASSWORD = "cell 3", "correct horse battery"
OTHER = "ab" * 32
pytestmark = pytest.mark.usefixtures("own_certificate")
TOOL = robolink.ToolOffset(1.0, 2.0, 3.0)
BLOCK = (*[7] * 62, 0, 7)
"""Words of a command, whose beat is what it is at first."""


@pytest.fixture(scope="module")
def plc():
    """The PLC behind both servers."""
    return SoftMotionSimulator()


@pytest.fixture(scope="module")
def server(plc):
    with serve_opcua(plc, users={USER: Secret(PASSWORD)}) as host:
        yield host


@pytest.fixture(scope="module")
def open_server(plc):
    """One that knows no users."""
    with serve_opcua(plc) as host:
        yield host


@pytest.fixture
def cell(server, tmp_path, monkeypatch):
    """A cell file that names the server's address and its user, and no pin."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_PASSWORD", PASSWORD)
    path = tmp_path / "robolink.toml"
    path.write_text(f'[cells.line3]\nurl = "{bare(server)}"\nuser = "{USER}"\n')
    return path


def bare(server):
    return server.secured_url.partition("?")[0]


def pinned(server, **options):
    told = {"server_certificate": server.fingerprint, "user": USER, **options}
    query = "&".join(f"{name}={value}" for name, value in told.items() if value)
    return f"{bare(server)}?{query}".replace(" ", "%20")


def opened(url, password=PASSWORD):
    return closing(open_mailbox_link(url, password=Secret(password) if password else None))


def test_a_pinned_server_is_read_and_written_by_its_user(server):
    with opened(pinned(server)) as link:
        assert link.read_head().heartbeat >= 0
        link.beat(0x0101)


@pytest.mark.parametrize(
    ("options", "password", "error", "why"),
    [
        ({"server_certificate": ""}, PASSWORD, ConfigError, "Nobody has compared"),
        ({"server_certificate": OTHER}, PASSWORD, ConfigError, "another certificate"),
        ({"security": "Aes256Sha256RsaPss"}, PASSWORD, None, ""),
        ({}, "staple battery horse", LoginRefusedError, USER),
        ({}, "", ConfigError, "no password"),
        ({"security": "none"}, PASSWORD, ConfigError, "protects nothing"),
        ({"security": "none", "user": ""}, "", ConfigError, "protects nothing"),
        (
            {"security": "none", "server_certificate": ""},
            PASSWORD,
            ConfigError,
            "no password is sent without encryption",
        ),
    ],
)
def test_what_would_not_be_safe_is_refused_by_name(server, options, password, error, why):
    if error is None:
        with opened(pinned(server, **options), password) as link:
            link.beat(0x0102)
        return
    with pytest.raises(error, match=why) as told, opened(pinned(server, **options), password):
        pass
    assert PASSWORD not in str(told.value)
    if "another certificate" in why:
        for digits in (server.fingerprint, OTHER):
            assert shown.grouped_by_colon(digits) in str(told.value)
        assert "cell trust" in told.value.remedy


def test_without_a_user_or_encryption_it_only_reads_and_stops(plc, open_server):
    plc.log.clear()
    for options in ("security=none", f"server_certificate={open_server.fingerprint}"):
        url, sent = f"{bare(open_server)}?{options}", plc.plc.program.inbox.words
        with opened(url, "") as link:
            assert link.read_response()
            with pytest.raises(ConfigError, match="for reading only"):
                link.beat(0x0101)
        with robolink.connect(url) as it, pytest.raises(ConfigError, match="reading only"):
            it.tools.write(3, TOOL, expected=None)
        assert plc.plc.program.inbox.words == sent
        assert stop_now(url).state
        with robolink.connect(url) as it:
            it.stop()
            with pytest.raises(ConfigError, match="reading only"):
                it.reset_fault()
    arrived = [text for _, way, text in plc.log if way == ">"]
    writes = [text.split()[:2] for text in arrived if text.startswith(("write", "beat"))]
    assert writes == [["write_command", "STOP"]] * 4
    with opened(f"{bare(open_server)}?security=none&write_unsecured=yes", "") as link:
        link.beat(0x0101)


def test_a_key_that_others_can_read_holds_no_stop_back_and_is_told(cell, server, capsys):
    cell.write_text(cell.read_text() + f'server_certificate = "{server.fingerprint}"\n')
    path, _ = own.own_files()
    path.chmod(0o644)
    with pytest.raises(ConfigError, match="Others than its owner"), opened(pinned(server)):
        pass
    assert main.run(["-c", "line3", "stop"]) == 0, capsys.readouterr().err
    said = capsys.readouterr()
    assert "Others than its owner" in said.out + said.err


@contextmanager
def listener(answer):
    """Stand at an address and do to what comes what ``answer`` does."""
    with socket.create_server(("127.0.0.1", 0)) as place:
        heard: list[bytes] = []

        def serve():
            with place:
                while True:
                    try:
                        line, _ = place.accept()
                    except OSError:
                        return
                    with line:
                        answer(line, heard)

        threading.Thread(target=serve, daemon=True).start()
        yield place.getsockname()[1], heard
        place.shutdown(socket.SHUT_RDWR)


@contextmanager
def in_between(server, change=bytes, then=None, to_server=bytes):
    """Stand between client and server, and change what goes on: to the client, or to the server.

    With ``then`` only the first connection leads to the server, and the others there.
    """
    targets = [parse_url(bare(server))]

    def carry(line, heard):
        target = targets[-1]
        targets.extend([parse_url(bare(then))] if then else [])
        with socket.create_connection((target.host, target.port)) as beyond:

            def back():
                try:
                    while data := beyond.recv(65536):
                        line.sendall(change(data))
                except OSError:
                    pass
                finally:
                    line.close()

            threading.Thread(target=back, daemon=True).start()
            try:
                while data := line.recv(65536):
                    heard.append(data)
                    beyond.sendall(to_server(data))
            except OSError:
                pass

    with listener(carry) as (port, heard):
        yield f"softmotion+opcua://127.0.0.1:{port}", heard


def test_whoever_stands_in_between_sees_no_password_and_no_word(server):
    with in_between(server) as (url, heard):
        query = pinned(server).partition("?")[2]
        with opened(f"{url}?{query}") as link:
            link.beat(0x4242)
            assert link.read_response()
    wire = b"".join(heard)
    assert len(wire) > 3000
    assert PASSWORD.encode() not in wire
    assert USER.encode() not in wire
    assert b"RL_Symbols" not in wire


def writes_a_block(data):
    """Return whether a message of an open session is long enough to hold a command block."""
    return data[:3] == b"MSG" and len(data) > 250


@pytest.mark.parametrize("place", [-1, -100])
def test_an_encrypted_command_that_was_changed_is_not_carried_out(place):
    """The same change of one that is not encrypted arrives: it is in the block's words."""
    changing = threading.Event()

    def change(data):
        if not changing.is_set() or not writes_a_block(data):
            return data
        changing.clear()
        bent = bytearray(data)
        bent[place] ^= 1
        return bytes(bent)

    simulator = SoftMotionSimulator()
    inbox = simulator.plc.program.inbox
    with serve_opcua(simulator, users={USER: Secret(PASSWORD)}) as server:
        with in_between(server, to_server=change) as (url, _):
            query, before = pinned(server).partition("?")[2], inbox.words
            with opened(f"{url}?{query}") as link:
                changing.set()
                link._client._timeout_s = 1.0  # this server says nothing to it
                with pytest.raises((TransportError, RemoteProtocolError)):
                    link.write_command(BLOCK)
        assert not changing.is_set()
        assert inbox.words == before
    with serve_opcua(simulator) as server, in_between(server, to_server=change) as (url, _):
        with opened(f"{url}?security=none&write_unsecured=yes", "") as link:
            changing.set()
            link.write_command(BLOCK)
        assert not changing.is_set()
        assert inbox.words not in (before, BLOCK)


def written_tool(plc):
    plc.tools.write(3, TOOL, expected=None)


def begun_movement(plc):
    group = plc.groups[0]
    pose = group.pose()
    up = replace(pose, z_mm=pose.z_mm + 5)
    slowly = MotionProfile(Path.STRAIGHT, speed_mm_s=10)
    group.move_to(up, slowly, box=WorkBox()).wait(timeout_s=20)


@pytest.mark.parametrize("job", [written_tool, begun_movement])
def test_a_refusal_that_was_forged_is_none(job):
    """An ``ERR`` has no signature on an encrypted channel either: the command was carried out."""
    forging = threading.Event()
    forged = []

    def to_server(data):
        if forging.is_set() and writes_a_block(data):
            forging.clear()
            forged.append(told_error("BadNotWritable"))
        return data

    def change(data):
        return forged.pop() if forged else data

    simulator = SoftMotionSimulator(seed=1)
    log = memory_journal("forged").log("forged")
    with (
        serve_opcua(simulator, users={USER: Secret(PASSWORD)}) as server,
        in_between(server, change, to_server=to_server) as (url, _),
        robolink.connect(
            f"{url}?{pinned(server).partition('?')[2]}", password=PASSWORD, outcomes=log
        ) as plc,
    ):
        plc.motors(True)
        plc.tools.write(2, TOOL, expected=None)
        forging.set()
        with pytest.raises(OutcomeUnknownError, match="BadNotWritable"):
            job(plc)
        assert len(log.open_markers()) == 1


def test_a_server_that_offers_less_by_now_is_refused_and_gets_no_password(server):
    """A man in the middle takes the encrypted endpoints out of the unprotected list."""
    policies = (b"Basic256Sha256", b"Aes256_Sha256_RsaPss", b"Aes128_Sha256_RsaOaep")

    def change(data):
        for policy in policies:
            data = data.replace(policy, b"X" * len(policy))
        return data

    with in_between(server, change) as (url, heard):
        query = pinned(server).partition("?")[2]
        with (
            pytest.raises(RejectedError, match="no signed and encrypted connection"),
            opened(f"{url}?{query}"),
        ):
            pass
    assert not any(b"OPN" in data and PASSWORD.encode() in data for data in heard)
    assert PASSWORD.encode() not in b"".join(heard)


def test_another_server_in_its_place_is_refused(server):
    with (
        serve_opcua(SoftMotionSimulator(), users={USER: Secret(PASSWORD)}) as other,
        pytest.raises(ConfigError, match="another certificate"),
        opened(f"{bare(other)}?{pinned(server).partition('?')[2]}"),
    ):
        pass


@pytest.mark.soak
def test_one_that_shows_its_certificate_without_having_its_key_gets_nothing(server, monkeypatch):
    """Certificates are public: the list of endpoints is the real one, the server another."""
    keys = opcua_certificate._key
    monkeypatch.setattr(opcua_certificate, "_key", keys.__wrapped__)
    with serve_opcua(SoftMotionSimulator(), users={USER: Secret(PASSWORD)}) as other:
        with in_between(server, then=other) as (url, heard):
            query = pinned(server).partition("?")[2]
            with pytest.raises(robolink.errors.RobolinkError) as told, opened(f"{url}?{query}"):
                pass
        assert not isinstance(told.value, ConfigError)
        assert PASSWORD.encode() not in b"".join(heard)
        assert b"OPN" in b"".join(heard)


def test_one_that_has_ended_is_told_and_a_stop_goes_out_all_the_same():
    simulator = SoftMotionSimulator()
    with serve_opcua(simulator, users={USER: Secret(PASSWORD)}, expired=True) as server:
        assert any("ended" in one for one in ask_certificate(parse_url(bare(server))).remarks("x"))
        with pytest.raises(ConfigError, match="counts from") as told, opened(pinned(server)):
            pass
        assert "cell trust" in told.value.remedy
        stop_now(pinned(server), password=PASSWORD)


def test_an_own_certificate_that_has_ended_holds_no_stop_back(server, monkeypatch):
    with opened(pinned(server)):
        pass
    real = wall_time()
    later = real + timedelta(days=own.VALID_DAYS + 1)
    monkeypatch.setattr(own, "wall_time", lambda: later)
    with pytest.raises(ConfigError, match="This computer's certificate"), opened(pinned(server)):
        pass
    stop_now(pinned(server), password=PASSWORD)


class Typing:
    """Answers as a person does who reads the PLC's own tool."""

    def __init__(self, monkeypatch, answer):
        self.asked: list[str] = []
        monkeypatch.setattr(commands, "person_here", lambda: Person.TERMINAL)

        def ask(question):
            self.asked.append(question)
            return answer(question)

        monkeypatch.setattr(commands, "asked_for_text", ask)


def groups(digits):
    return [digits[at : at + 4].upper() for at in range(0, len(digits), 4)]


def hidden_of(question):
    return (int(question.split("digits ")[1].split()[0]) - 1) // 4


@pytest.mark.parametrize("by", ["digits", pytest.param("thumbprint", marks=pytest.mark.soak)])
def test_a_person_who_compared_it_keeps_it_in_the_cell_file(cell, server, monkeypatch, capsys, by):
    told = ask_certificate(parse_url(bare(server)))
    typing = Typing(monkeypatch, lambda q: groups(getattr(told, by))[hidden_of(q)].lower())
    assert main.run(["-c", "line3", "cell", "trust"]) == 0
    out = capsys.readouterr().out
    assert len(typing.asked) == 1
    hidden = hidden_of(typing.asked[0])
    lines = [line.split() for line in out.splitlines() if line.startswith("    ")]
    expected = groups(told.digits)
    expected[hidden] = "____"
    assert lines[0] + lines[1] == expected
    assert groups(told.digits)[hidden] not in lines[0] + lines[1] or (
        groups(told.digits).count(groups(told.digits)[hidden]) > 1
    )
    assert find_cell("line3").settings.server_certificate == told.fingerprint
    with connect_cell("line3") as plc:
        assert plc.status().state
    before = cell.read_bytes()
    assert main.run(["-c", "line3", "cell", "trust"]) == 0
    assert "Nothing was changed" in capsys.readouterr().out
    assert cell.read_bytes() == before


@pytest.mark.parametrize("answer", ["0000x", "y", "yes", "FFFFF"])
def test_a_wrong_answer_keeps_nothing(cell, server, monkeypatch, capsys, answer):
    before = cell.read_bytes()
    Typing(monkeypatch, lambda _: answer)
    assert main.run(["-c", "line3", "cell", "trust"]) == 9
    assert "another computer answers" in capsys.readouterr().err
    assert cell.read_bytes() == before


@pytest.mark.soak
def test_neither_enter_nor_what_was_typed_before_the_question_keeps_anything(cell, server):
    told = ask_certificate(parse_url(bare(server)))
    before = cell.read_bytes()
    terminal = Terminal("-c", "line3", "cell", "trust")
    try:
        terminal.press("\r\n".join(groups(told.digits)).encode() + b"\r\n")
        terminal.wait_for("Typed too early and ignored")
        terminal.wait_for("type what it shows in place of")
        terminal.press(b"\r")
        assert terminal.end() == 9
    finally:
        terminal.close()
    assert cell.read_bytes() == before


def test_nobody_there_keeps_nothing(cell, server, capsys):
    before = cell.read_bytes()
    assert main.run(["-c", "line3", "cell", "trust"]) == 9
    assert main.run(["-c", "line3", "cell", "trust", "--yes"]) == 2
    capsys.readouterr()
    assert main.run(["-c", "line3", "cell", "trust", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["kept"] is False
    assert document["fingerprint_sha256"].replace(":", "").lower() == server.fingerprint
    assert cell.read_bytes() == before


def test_another_certificate_than_before_is_said_before_it_is_asked_for(
    cell, server, monkeypatch, capsys
):
    cell.write_text(cell.read_text() + f'server_certificate = "{OTHER}"\n')
    with pytest.raises(ConfigError, match="another certificate"):
        connect_cell("line3")
    Typing(monkeypatch, lambda q: groups(server.fingerprint)[hidden_of(q)])
    assert main.run(["-c", "line3", "cell", "trust"]) == 0
    out = capsys.readouterr().out
    assert "ANOTHER CERTIFICATE" in out
    assert " ".join(groups(OTHER)) in out
    assert (
        parse_url(find_cell("line3").url).options["server_certificate"].replace(":", "").lower()
        == server.fingerprint
    )


@pytest.mark.parametrize("near", ["pin", "url"])
def test_of_several_cell_files_the_pin_is_kept_where_it_counts(
    cell, server, monkeypatch, capsys, tmp_path, near
):
    far = tmp_path / "xdg" / "robolink" / "robolink.toml"
    far.parent.mkdir(parents=True)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))
    pin = f'[cells.line3]\nserver_certificate = "{OTHER}"\n'
    there, here = (cell.read_text(), pin) if near == "pin" else (pin, cell.read_text())
    far.write_text(there)
    cell.write_text(here)
    Typing(monkeypatch, lambda q: groups(server.fingerprint)[hidden_of(q)])
    assert main.run(["-c", "line3", "cell", "trust"]) == 0
    assert f"Written: {cell}" in capsys.readouterr().out
    with connect_cell("line3") as plc:
        assert plc.status().state


def test_a_pin_that_counts_nowhere_is_not_called_written(cell, server, monkeypatch, capsys):
    """A file that says something else afterwards, for whatever reason."""
    Typing(monkeypatch, lambda q: groups(server.fingerprint)[hidden_of(q)])
    monkeypatch.setattr(config, "set_cell_key", lambda *_: None)
    assert main.run(["-c", "line3", "cell", "trust"]) == 2
    said = capsys.readouterr()
    assert "Written" not in said.out
    assert "another file says otherwise" in said.err


def test_a_url_gets_its_option_told(server, monkeypatch, capsys):
    Typing(monkeypatch, lambda q: groups(server.fingerprint)[hidden_of(q)])
    assert main.run(["-c", bare(server), "cell", "trust"]) == 0
    assert f"server_certificate={server.fingerprint}" in capsys.readouterr().out


def test_what_is_not_opc_ua_has_none_to_compare(capsys):
    assert main.run(["-c", "epson+sim://trust", "cell", "trust"]) == 2
    assert "not reached over OPC UA" in capsys.readouterr().err


def test_the_password_is_in_no_trace_and_no_journal(cell, server, monkeypatch, tmp_path, capsys):
    cell.write_text(cell.read_text() + f'server_certificate = "{server.fingerprint}"\n')
    heard = []
    with connect_cell("line3", trace=lambda *passage: heard.append(passage)) as plc:
        plc.tools.read(1)
    assert heard
    assert not any(PASSWORD.encode() in data for _, _, data in heard)
    assert main.run(["-c", "line3", "--record", str(tmp_path / "wire.txt"), "status"]) == 0
    assert PASSWORD not in (tmp_path / "wire.txt").read_text()
    said = capsys.readouterr()
    assert PASSWORD not in said.out + said.err


def test_stop_from_a_terminal_logs_in_as_the_cell_says(cell, server, capsys):
    cell.write_text(cell.read_text() + f'server_certificate = "{server.fingerprint}"\n')
    assert main.run(["-c", "line3", "stop"]) == 0, capsys.readouterr().err


def test_status_says_how_a_connection_is_protected(open_server, capsys):
    for options, said in (
        ("security=none&write_unsecured=yes", "WITHOUT ENCRYPTION"),
        ("security=none", "only reads"),
        (f"server_certificate={open_server.fingerprint}", "Nobody logs in"),
    ):
        assert main.run(["-c", f"{bare(open_server)}?{options}", "status"]) == 0
        assert said in capsys.readouterr().err


def test_every_command_says_that_it_may_write_without_encryption(
    open_server, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    url = f"{bare(open_server)}?security=none&write_unsecured=yes"
    (tmp_path / "robolink.toml").write_text(f'[cells.a]\nurl = "{url}"\n')
    for argv in (["check"], ["expert", "verify-controller"], ["stop"]):
        main.run(["-c", "a", *argv])
        assert "WITHOUT ENCRYPTION" in capsys.readouterr().err, argv
    with CellActs(tmp_path / "backups", tell=told.append) as acts:
        table = {"schema": "robolink/fleet-plan/1", "kind": "check", "name": "n", "cells": ["a"]}
        plan = plan_of(table, cells=["a"], author="Li", made_at="2026-11-30T22:00:00+00:00")
        assert [acts(plan, "a", None).error for _ in range(2)] == ["", ""]
    assert len(told) == 1
    assert told[0].startswith("a: OPC UA WITHOUT ENCRYPTION")
    path = written_symbol_map(tmp_path)
    with serve_plc_opcua(PlcSimulator(load_symbol_map(path)), path) as host:
        for more in ([], ["--browse", "/DeviceSet"]):
            main.run(["-c", host.url, "expert", "plc", "check-map", *more])
            assert "WITHOUT ENCRYPTION" in capsys.readouterr().err, more


def test_a_page_of_a_change_says_how_the_plc_was_reached(open_server, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points = tmp_path / "a.pts"
    place = "\n".join(f"\tr{axis}={value}" for axis, value in zip("XYZUVW", range(6), strict=True))
    points.write_text(
        f"nNumberOfPoints=1\nPoint1 {{\n\tnNumber=1\n\tnUndefined=448\n{place}\n"
        "\tnLocal=0\n\tnHand=1\n}\n"
    )
    url = f"{bare(open_server)}?security=none&write_unsecured=yes"
    argv = ["-c", url, "tool", "impact", "--tool", "1", "--x", "2", "--pts", str(points)]
    assert main.run([*argv, "--report", "page.html"]) == 0
    assert "OPC UA WITHOUT ENCRYPTION" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_check_and_doctor_say_that_a_certificate_ends(cell, server, monkeypatch, capsys):
    cell.write_text(cell.read_text() + f'server_certificate = "{server.fingerprint}"\n')
    made = own.own_certificate()
    monkeypatch.setattr(type(made), "ends_soon", property(lambda _: True))
    monkeypatch.setattr(shown.OfferedCertificate, "ends_soon", property(lambda _: True))
    assert main.run(["-c", "line3", "check", "--json"]) == 1
    (found,) = json.loads(capsys.readouterr().out)["cells"]
    ends = [one["subject"] for one in found["findings"] if one["code"] == "certificate_ends"]
    assert ends == ["own", "server"]
    main.run(["cell", "doctor"])
    assert "certificate ends on" in capsys.readouterr().out
