"""Snapshots over HTTP: real servers on loopback that do everything wrong that cameras do."""

import hashlib
import struct
import time
import zlib

import numpy as np
import pytest

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.cameras.http import HttpSource
from robolink.eye.opening import open_source
from tests.eye._picture_servers import SIZE_PX, Scene, answer, encoded, pgm, serving

LIMIT_S = 0.4


def taken(handle, path="/snapshot", user="", timeout_s=5.0):
    with serving(handle) as server:
        return HttpSource(server.url(path, user), timeout_s=timeout_s).take()


def refusal(handle, path="/snapshot", user="", timeout_s=5.0):
    """Return how a picture is refused; nothing secret is in it."""
    with serving(handle) as server:
        source = HttpSource(server.url(path, user), timeout_s=timeout_s)
        with pytest.raises(CalibrationError) as raised:
            source.take()
    told = f"{raised.value} {raised.value.__cause__} {source.identity}"
    assert "correct-horse" not in told
    assert raised.value.remedy
    return raised.value


@pytest.mark.parametrize(
    ("kind", "encode", "near"),
    [
        ("image/x-portable-graymap", pgm, 0),
        ("image/png", encoded, 0),
        ("image/bmp", lambda grey: encoded(grey, "BMP"), 0),
        ("image/tiff", lambda grey: encoded(grey, "TIFF"), 0),
        ("image/jpeg", lambda grey: encoded(grey, "JPEG", quality=95), 12),
        ("text/plain", pgm, 0),  # what it is called makes no difference
    ],
)
def test_a_picture_of_each_kind_comes_as_it_was(kind, encode, near):
    grey = Scene()()
    data = encode(grey)
    picture = taken(lambda *_: answer(data, kind))
    assert np.abs(picture.grey.astype(int) - grey).max() <= near
    assert picture.size_px == SIZE_PX
    assert picture.digest == hashlib.sha256(data).hexdigest()
    assert picture.encoded == data
    assert picture.begun_s is None  # a server may hand out what it had


def test_colour_becomes_luminance_and_a_turned_picture_is_not_turned():
    colours = np.zeros((*SIZE_PX[::-1], 3), np.uint8)
    colours[:, :80] = (255, 0, 0)
    colours[:60] = (0, 255, 0)
    picture = taken(lambda *_: answer(encoded(colours)))
    assert {int(value) for value in np.unique(picture.grey)} == {0, 76, 150}
    turned = b"II*\x00\x08\x00\x00\x00\x01\x00\x12\x01\x03\x00\x01\x00\x00\x00\x06\x00\x00\x00"
    exif = b"Exif\x00\x00" + turned + b"\x00\x00\x00\x00"
    grey = Scene()()
    data = encoded(grey, "JPEG", exif=exif)
    assert taken(lambda *_: answer(data)).size_px == SIZE_PX


@pytest.mark.parametrize(("highest", "shift"), [(65535, 8), (4095, 4)])
def test_of_sixteen_bits_the_upper_eight_count(highest, shift):
    values = np.linspace(0, highest, 160 * 120).reshape(120, 160).astype(np.uint16)
    picture = taken(lambda *_: answer(encoded(values)))
    assert np.array_equal(picture.grey, (values >> shift).astype(np.uint8))
    data = b"P5\n# a comment\n160 120\n%d\n" % highest + values.astype(">u2").tobytes()
    assert np.abs(taken(lambda *_: answer(data)).grey.astype(int) - (values >> shift)).max() <= 1


def test_it_asks_for_no_stored_picture_and_names_no_length_of_its_own():
    with serving(lambda *_: answer(pgm(Scene()()))) as server:
        HttpSource(server.url("/snap.cgi?channel=2")).take()
    (request,) = server.requests
    assert request.startswith("GET /snap.cgi?channel=2 HTTP/1.1\r\n")
    assert "Cache-Control: no-cache, no-store\r\n" in request
    assert "Connection: close\r\n" in request
    assert "Authorization" not in request


def test_chunks_and_an_end_by_closing_are_read():
    data = pgm(Scene()())

    def chunked(request, connection):
        connection.sendall(b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n")
        for at in range(0, len(data), 5000):
            part = data[at : at + 5000]
            connection.sendall(b"%x\r\n" % len(part) + part + b"\r\n")
        return b"0\r\n\r\n"

    assert taken(chunked).encoded == data
    assert taken(lambda *_: b"HTTP/1.0 200 OK\r\n\r\n" + data).encoded == data


@pytest.mark.parametrize(
    ("handle", "code", "word"),
    [
        (lambda *_: answer(b"<html>log in</html>", "text/html"), "picture_unreadable", "text"),
        (lambda *_: answer(b"", "image/jpeg"), "picture_unreadable", "empty"),
        (lambda *_: answer(b"\xff\xd8\xff\xe0 junk" * 9), "picture_unreadable", "picture"),
        (lambda *_: b"SSH-2.0-OpenSSH\r\n", "picture_unreadable", "HTTP"),
        (lambda *_: answer(b"no", status="404 Not Found"), "camera_refused", "404"),
        (lambda *_: answer(b"no", status="500 Oops"), "camera_refused", "500"),
        (lambda *_: answer(b"no", status="401 Who"), "camera_refused", "password"),
        (lambda *_: answer(b"no", status="403 No"), "camera_refused", "password"),
        (lambda *_: answer(b"no", status="503 Busy"), "camera_taken", "503"),
        (lambda *_: b"", "camera_gone", "answer"),
        (lambda *_: answer(encoded(np.zeros((8, 8), np.uint8))), "picture_unreadable", "8 x 8"),
    ],
)
def test_what_is_no_picture_is_refused_by_name(handle, code, word):
    error = refusal(handle)
    assert error.code == code
    assert word in str(error)


@pytest.mark.parametrize("kind", ["JPEG", "PNG"])
@pytest.mark.parametrize("announced", [True, False])
def test_half_a_picture_is_none(kind, announced):
    data = encoded(Scene()(), kind)
    half = data[: len(data) // 2]
    head = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % (
        len(data) if announced else len(half)
    )
    assert refusal(lambda *_: head + half).code == "picture_unreadable"


def test_half_a_pgm_is_none():
    data = pgm(Scene()())
    assert refusal(lambda *_: answer(data[:-1])).code == "picture_unreadable"


def test_a_bomb_is_refused_before_it_fills_the_memory():
    def chunk(kind, body):
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 0, 0, 0, 0)
    bomb = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"0" * 99))
    error = refusal(lambda *_: answer(bomb))
    assert error.code == "picture_unreadable"
    assert "60000" in str(error)
    assert refusal(lambda *_: answer(b"P5 60000 60000 255\n")).code == "picture_unreadable"


def test_an_endless_body_ends_with_its_time():
    def endless(request, connection):
        connection.sendall(b"HTTP/1.1 200 OK\r\n\r\n")
        while True:
            connection.sendall(b"P" * 65536)

    assert refusal(endless, timeout_s=LIMIT_S).code in ("picture_late", "picture_unreadable")


@pytest.mark.parametrize("part", ["nothing", "a header", "half a body"])
def test_one_deadline_holds_for_the_whole_exchange(part):
    data = pgm(Scene()())

    start = {
        "nothing": b"",
        "a header": b"HTTP/1.1 200 OK\r\nX: ",
        "half a body": answer(data)[:9000],
    }
    byte = {"nothing": b"", "a header": b"x", "half a body": b"\0"}[part]

    def drip(request, connection):
        connection.sendall(start[part])
        while not server.ended.wait(0.05):
            connection.sendall(byte)  # it would satisfy a limit on each read

    with serving(drip) as server:
        begun = time.monotonic()
        with pytest.raises(CalibrationError) as raised:
            HttpSource(server.url(), timeout_s=LIMIT_S).take()
        took_s = time.monotonic() - begun
        server.ended.set()
    assert raised.value.code == "picture_late"
    assert LIMIT_S * 0.9 < took_s < 10 * LIMIT_S


def test_a_camera_that_is_not_there_is_gone():
    with serving(lambda *_: b"") as server:
        url = server.url()
    with pytest.raises(CalibrationError) as raised:
        HttpSource(url).take()
    assert raised.value.code == "camera_gone"


def test_a_redirect_is_followed_on_the_same_host_only():
    data = pgm(Scene()())

    def moved(request, connection):
        if request.startswith("GET /new "):
            return answer(data)
        return answer(b"", status="302 Found", more="Location: /new\r\n")

    assert taken(moved).encoded == data
    with serving(lambda *_: answer(data)) as other:
        away = f"Location: http://127.0.0.1:{other.port}/x\r\n"
        error = refusal(
            lambda *_: answer(b"", status="302 Found", more=away), user="me:correct-horse@"
        )
        assert other.requests == []
    assert error.code == "camera_refused"
    assert "another host" in str(error)
    circle = answer(b"", status="302 Found", more="Location: /snapshot\r\n")
    assert refusal(lambda *_: circle).code == "camera_refused"


@pytest.mark.parametrize("way", ["Basic", "Digest"])
def test_user_and_password_are_sent_when_they_are_asked_for(way):
    data = pgm(Scene()())
    digest = 'Digest realm="cam", nonce="abc", qop="auth", algorithm=MD5'

    def asks(request, connection):
        told = [line for line in request.splitlines() if line.startswith("Authorization:")]
        if not told:
            challenge = digest if way == "Digest" else 'Basic realm="cam"'
            return answer(b"", status="401 Who", more=f"WWW-Authenticate: {challenge}\r\n")
        assert "correct-horse" not in told[0]
        if way == "Basic":
            right = told[0] == "Authorization: Basic bWU6Y29ycmVjdC1ob3JzZQ=="
        else:
            right = is_digest(told[0])
        return answer(data) if right else answer(b"", status="403 No")

    picture = taken(asks, user="me:correct-horse@")
    assert picture.encoded == data
    assert "me" not in picture.name.split("//")[1].split("/")[0]
    wrong = refusal(asks, user="me:other-horse@")
    assert wrong.code == "camera_refused"


def is_digest(header):
    fields = dict(part.strip().split("=", 1) for part in header.partition("Digest ")[2].split(","))
    told = {key: value.strip('"') for key, value in fields.items()}

    def md5(text):
        return hashlib.md5(text.encode()).hexdigest()

    first, second = md5("me:cam:correct-horse"), md5("GET:/snapshot")
    joined = f"{first}:abc:{told['nc']}:{told['cnonce']}:auth:{second}"
    return told["response"] == md5(joined) and told["uri"] == "/snapshot"


def test_nobody_is_told_a_password_that_was_not_asked_for():
    with serving(lambda *_: answer(pgm(Scene()()))) as server:
        HttpSource(server.url(user="me:correct-horse@")).take()
    assert "Authorization" not in server.requests[0]


@pytest.mark.parametrize(
    "url",
    [
        "http://",
        "http:///snap",
        "http://cam:port/snap",
        "http://me:correct/horse@cam/snap",
        "http://cam/a b",
        "http://cam/a\nHost: other",
        "http://cam\r\n/",
        "ftp://cam/snap",
    ],
)
def test_what_is_no_address_is_refused_without_its_password(url):
    with pytest.raises(ConfigError) as raised:
        open_source(url)
    assert "horse" not in str(raised.value)


def test_passwords_in_options_are_not_shown():
    source = open_source("http://me:correct-horse@cam/snap?channel=2&user=me&pwd=1&sig=4711battery")
    assert source.identity == "http://cam/snap?channel=2&user=...&pwd=...&sig=..."
    assert "battery" not in repr(vars(source))
    assert "correct" not in repr(vars(source))
