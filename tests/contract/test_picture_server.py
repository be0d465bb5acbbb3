"""Drawn pictures as a network camera serves them, over real TCP on loopback."""

import io
import socket
import time
from contextlib import ExitStack
from dataclasses import replace
from http.client import HTTPConnection, IncompleteRead, RemoteDisconnected
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import urlopen

import numpy as np
import pytest
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.server import MOST_CLIENTS, PictureServer

from robolink.controllers import SoftMotionController
from robolink.errors import ConfigError, ConnectError
from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from tests.contract._camera_cell import KINDS, cell_of, furnish
from tests.unit._drawn_cells import PLAIN, bring_to, cell_before_camera
from tests.unit.test_drawn_camera import column_of

_PATIENCE_S = 30.0


@pytest.fixture
def cell():
    return cell_before_camera(camera_turn_deg=0.0, **PLAIN)


@pytest.fixture
def server(cell):
    with PictureServer(DrawnCamera(cell)) as server:
        yield server


def fetched(url):
    with urlopen(url, timeout=_PATIENCE_S) as answer:
        return answer.read()


def from_pgm(data):
    magic, width, height, most = data.split(maxsplit=4)[:4]
    assert (magic, most) == (b"P5", b"255")
    pixels = np.frombuffer(data[-int(width) * int(height) :], np.uint8)
    return pixels.reshape(int(height), int(width))


@pytest.fixture
def pillow():
    return pytest.importorskip("PIL.Image", reason="reading PNG and JPEG needs Pillow")


def test_a_snapshot_shows_the_tip_where_it_is(cell, server):
    for step in (0, 2, 5):
        bring_to(cell, (float(step), 0.0, 0.0))
        assert column_of(from_pgm(fetched(server.url("pgm")))) == step
    assert server.requests == 3


def test_png_is_the_same_picture_and_jpeg_nearly(cell, server, pillow):
    cell.world.set_up(WorldParameters(picture_stuck="same", **PLAIN))
    pgm = from_pgm(fetched(server.url("pgm")))
    png = np.asarray(pillow.open(io.BytesIO(fetched(server.url("png")))))
    jpeg = np.asarray(pillow.open(io.BytesIO(fetched(server.url("jpg")))))
    assert np.array_equal(png, pgm)
    assert jpeg.shape == pgm.shape
    assert np.abs(jpeg.astype(int) - pgm).mean() < 2.0


def test_only_who_knows_the_token_sees_pictures(server):
    parts = urlsplit(server.url("pgm"))
    _, token, name = parts.path.split("/")
    for path, status in (
        (f"/{token[:-1]}/{name}", 403),
        (f"/{name}", 403),
        ("/", 403),
        (f"/{token}/", 404),
        (f"/{token}/snapshot.bmp", 404),
        (f"/{token}/../snapshot.pgm", 404),
    ):
        with pytest.raises(HTTPError) as refused:
            fetched(f"http://{parts.netloc}{path}")
        refused.value.close()
        assert refused.value.code == status, path
    assert server.requests == 0


def test_it_listens_where_others_reach_it_only_if_told_so(cell):
    with pytest.raises(ConfigError):
        PictureServer(DrawnCamera(cell), ("0.0.0.0", 0))


def test_a_port_that_is_taken_is_named(cell, server):
    port = urlsplit(server.url()).port
    assert port is not None
    with pytest.raises(ConnectError, match=str(port)):
        PictureServer(DrawnCamera(cell), ("127.0.0.1", port))


def test_one_connection_may_ask_again(cell, server):
    parts = urlsplit(server.url("pgm"))
    line = HTTPConnection(parts.netloc, timeout=_PATIENCE_S)
    shown = []
    for step in (1, 4):
        bring_to(cell, (float(step), 0.0, 0.0))
        line.request("GET", parts.path)
        shown.append(column_of(from_pgm(line.getresponse().read())))
    line.close()
    assert shown == [1, 4]


def test_a_camera_that_is_gone_or_delivers_halves_breaks_the_connection(cell, server):
    cell.world.set_up(WorldParameters(picture_gone=True))
    with pytest.raises(RemoteDisconnected):
        fetched(server.url("pgm"))
    cell.world.set_up(WorldParameters(picture_halved=True))
    with pytest.raises(IncompleteRead) as torn:
        fetched(server.url("pgm"))
    half = len(torn.value.partial)
    assert 600_000 < half < 700_000


def test_a_camera_that_hangs_keeps_no_others_from_asking_and_ends_with_its_server(cell):
    camera = DrawnCamera(cell)
    with PictureServer(camera) as server:
        cell.world.set_up(WorldParameters(picture_slow_s=3600.0, picture_faults_count=1))
        parts = urlsplit(server.url("pgm"))
        hung = HTTPConnection(parts.netloc, timeout=_PATIENCE_S)
        hung.request("GET", parts.path)
        _until(lambda: camera.asked == 1)
        assert fetched(server.url("pgm")).startswith(b"P5")
    with pytest.raises((RemoteDisconnected, ConnectionError)):
        hung.getresponse()
    hung.close()


def test_one_client_too_many_is_closed_and_finds_room_later(server):
    parts = urlsplit(server.url())
    with ExitStack() as stack:
        for _ in range(MOST_CLIENTS):
            line = socket.create_connection((parts.hostname, parts.port), _PATIENCE_S)
            stack.enter_context(line)
        with pytest.raises((OSError, RemoteDisconnected)):
            fetched(server.url("pgm"))
    _until(lambda: _answers(server))


def _answers(server):
    try:
        return fetched(server.url("pgm")).startswith(b"P5")
    except OSError:
        return False


def test_a_stream_that_nobody_reads_shows_old_pictures(cell, server, pillow):
    """What a driver must not take for the present: pictures wait where nobody reads them."""
    camera = server._camera
    bring_to(cell, (0.0, 0.0, 0.0))
    with urlopen(server.stream_url, timeout=_PATIENCE_S) as stream:
        assert "multipart/x-mixed-replace" in stream.headers["Content-Type"]
        _until(lambda: camera.asked >= 4)
        bring_to(cell, (5.0, 0.0, 0.0))
        before = camera.asked
        _until(lambda: camera.asked >= before + 2)
        parts = [_part(stream) for _ in range(before + 1)]
    shown = [column_of(np.asarray(pillow.open(io.BytesIO(part)))) for part in parts]
    assert shown[0] == 0
    assert shown[-1] == 5
    assert shown == sorted(shown)


def _part(stream):
    """Return the next picture of a stream."""
    length = 0
    while line := stream.readline():
        if line.lower().startswith(b"content-length:"):
            length = int(line.split(b":")[1])
        elif length and not line.strip():
            return stream.read(length)
    raise AssertionError("the stream ended")


def _until(happened):
    end_s = time.monotonic() + _PATIENCE_S
    while not happened():
        assert time.monotonic() < end_s
        time.sleep(0.02)


@pytest.mark.parametrize("kind", KINDS)
def test_a_picture_in_the_middle_of_a_movement_shows_the_tip_on_its_way(kind):
    with cell_of(kind) as cell, cell.connected() as controller:
        furnish(cell, camera_turn_deg=0.0, **PLAIN)
        bring_to(cell.simulator, (-4.0, 0.0, 0.0))
        camera, shown = DrawnCamera(cell.simulator), []
        if isinstance(controller, SoftMotionController):
            controller.take()
        group = controller.groups[0]
        here = group.pose()
        assert here is not None
        there = replace(here, x_mm=here.x_mm + 8.0)

        def look(*_):
            shown.append(column_of(camera.grey()))

        if kind == "softmotion":  # its client has to be heard while something moves
            cell.simulator.on_request = look
        motion = group.move_to(there, MotionProfile(Path.STRAIGHT, 10, 20.0), box=WorkBox())
        for _ in range(6 if kind == "epson" else 0):
            look()
            cell.clock.advance(0.12)
        assert motion.wait(timeout_s=30) is MotionOutcome.ARRIVED
        cell.simulator.on_request = None
    assert shown == sorted(shown)
    assert shown[0] == -4
    assert len(set(shown)) >= 4
    assert column_of(camera.grey()) == 4
