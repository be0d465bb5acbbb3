"""Pictures of a GigE camera over UDP: the fake camera of Aravis on loopback."""

import _thread
import re
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from robolink_simulators.pictures.gige_camera import (
    NOMINAL_EXPOSURE_US,
    GigeCamera,
    GigeFrame,
    fake_description,
)

from robolink.errors import CalibrationError, ConfigError, ConnectError
from robolink.eye.cameras.gige import aravis as binding
from robolink.eye.cameras.gige.opening import FoundCamera, located, open_gige
from robolink.eye.cameras.gige.pixel_formats import grey_pixels
from tests.eye.gige._scene import ADDRESS, Scene, taken_at_s

WIDTH, HEIGHT, X, Y = 0x100, 0x104, 0x130, 0x134
EXPOSURE_US, PIXEL_FORMAT = 0x120, 0x128
MODE, ACQUISITION = 0x12C, 0x124
TRIGGER_MODE, TRIGGER_SOURCE = 0x300, 0x304
OTHER_TRIGGER_MODE = 0x320
PRIVILEGE = 0xA00
CHANGED = (EXPOSURE_US, MODE, TRIGGER_MODE, TRIGGER_SOURCE, OTHER_TRIGGER_MODE)
PACKET_BYTES = 500
"""40 packets a picture of 160 x 120: that all or none of them are lost is out of question."""

LATE_S = 2.0
"""Patience of a test that waits in vain for one picture, after others that have to come in time."""


def refusal(source) -> CalibrationError:
    with pytest.raises(CalibrationError) as caught:
        source.take()
    return caught.value


def test_a_picture_is_what_the_camera_saw_and_not_older_than_the_question(serve, opened):
    scene = Scene()
    serve(scene, serial="RL-7")
    source = opened()
    assert source.identity == "gige Aravis Fake RL-7"
    digests = set()
    for _ in range(3):
        before_s = time.monotonic()
        picture = source.take()
        assert np.array_equal(picture.grey, scene.last)
        assert picture.size_px == (320, 240)
        exposed_s = taken_at_s(picture.grey)
        assert before_s <= picture.asked_s <= picture.begun_s <= exposed_s <= time.monotonic()
        digests.add(picture.digest)
    assert len(digests) == 3


def test_a_camera_is_released_and_has_its_settings_again(serve, opened):
    scene = Scene()
    camera = serve(scene)
    for register, value in ((TRIGGER_MODE, 1), (OTHER_TRIGGER_MODE, 1), (MODE, 2)):
        camera.write_register(register, value)  # somebody triggers it by a wire
    before = [camera.read_register(register) for register in CHANGED]
    for _ in range(3):  # as often as a run opens its camera
        source = opened()
        source.expose(20_000)
        source.take()
        during = [camera.read_register(register) for register in CHANGED]
        assert during == [20_000, 1, 1, 1, 0]
        source.close()
        source.close()
        assert [camera.read_register(register) for register in CHANGED] == before
        assert camera.read_register(PRIVILEGE) == 0
    with pytest.raises(CalibrationError, match="does not answer"):
        source.take()


def test_a_camera_without_a_software_trigger_begins_when_it_is_started(serve, opened, tmp_path):
    without = tmp_path / "camera.xml"
    whole = fake_description()
    for name in ("TriggerSoftware", "TriggerSelector"):
        whole = re.sub(rf'<(\w+) Name="{name}".*?</\1>', "", whole, flags=re.DOTALL)
    without.write_text(whole)
    scene = Scene()
    camera = serve(scene, description=str(without))
    source = opened()
    for _ in range(2):
        asked_s = time.monotonic()
        picture = source.take()
        assert asked_s <= picture.begun_s <= taken_at_s(picture.grey)
        assert camera.read_register(ACQUISITION) == 0  # else it would go on, 25 a second
    assert camera.read_register(MODE) == 2  # a single one
    assert camera.read_register(TRIGGER_MODE) == 0


def test_a_part_of_the_image_that_somebody_chose_stays_chosen(serve, opened):
    scene = Scene()
    camera = serve(scene)
    for register, value in ((X, 40), (Y, 20), (WIDTH, 100), (HEIGHT, 60)):
        camera.write_register(register, value)
    assert np.array_equal(opened().take().grey, scene.last[20:80, 40:140])


def test_the_exposure_is_set_and_read(serve, opened):
    grey = np.full((48, 64), 60, np.uint8)
    camera = serve(lambda: GigeFrame(grey), size_px=(64, 48))
    source = opened()
    assert source.exposure_us == NOMINAL_EXPOSURE_US
    assert source.take().grey.mean() == 60
    source.expose(2.5 * NOMINAL_EXPOSURE_US)
    assert source.exposure_us == camera.read_register(EXPOSURE_US) == 2.5 * NOMINAL_EXPOSURE_US
    assert source.take().grey.mean() == 150
    with pytest.raises(ConfigError, match="expose for 1e\\+09 us") as caught:
        source.expose(1e9)
    assert "between 10 and 1e+07 us" in caught.value.remedy
    assert source.take().grey.mean() == 150


def test_another_program_keeps_its_camera(serve, opened):
    camera = serve(Scene())
    with camera.held_by_another():
        with pytest.raises(CalibrationError, match="Another program is using") as caught:
            open_gige(ADDRESS)
        assert caught.value.code == "camera_taken"
    first = opened()
    with pytest.raises(CalibrationError) as caught:
        open_gige(ADDRESS)
    assert caught.value.code == "camera_taken"
    assert first.take().begun_s is not None
    with pytest.raises(ConnectError, match="Another program"), camera.held_by_another():
        pass


def test_packets_that_were_lost_once_cost_another_exposure(serve, opened):
    scene = Scene((160, 120))
    scene.frames = {1: {"lost": 0.5}, 2: {"lost": 0.5}}
    serve(scene, packet_bytes=PACKET_BYTES)
    asked_s = time.monotonic()
    picture = opened().take()
    assert np.array_equal(picture.grey, scene.last)
    assert scene.taken == 3
    assert taken_at_s(picture.grey) >= picture.begun_s > asked_s


def test_packets_that_are_lost_always_are_named(serve, opened):
    scene = Scene((160, 120))
    scene.frames = {number: {"lost": 0.5} for number in range(1, 4)}
    serve(scene, packet_bytes=PACKET_BYTES)
    source = opened()
    error = refusal(source)
    assert error.code == "packets_lost"
    assert "3 times in a row" in str(error)
    assert np.array_equal(source.take().grey, scene.last)


def test_a_late_picture_is_never_taken_for_the_next(serve, opened):
    scene = Scene()
    # The first would come while the second is waited for.
    scene.frames = {1: {"slow_s": 2.0}, 2: {"slow_s": 1.0}}
    serve(scene)
    source = opened(patience_s=1.5)
    assert refusal(source).code == "picture_late"
    asked_s = time.monotonic()
    picture = source.take()
    assert taken_at_s(picture.grey) >= asked_s
    assert np.array_equal(picture.grey, scene.last)


@pytest.mark.parametrize("set_back_s", [0, 3600], ids=["", "clock set back"])
def test_a_camera_that_ignores_its_trigger_has_no_old_picture_taken(
    serve, opened, monkeypatch, set_back_s
):
    real = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: real() - set_back_s * 1_000_000_000)
    scene = Scene()
    camera = serve(scene)
    source = opened()
    source.take()
    camera.ignore_triggers()
    for pause_s in (0.2, 0.0, 0.1):
        time.sleep(pause_s)  # pictures that nobody asked for come meanwhile
        asked_s = time.monotonic()
        picture = source.take()
        assert taken_at_s(picture.grey) >= picture.asked_s >= asked_s


def test_a_frame_whose_first_packet_came_before_the_question_does_not_count(
    serve, opened, monkeypatch
):
    scene = Scene()
    serve(scene)
    source = opened()
    hour_ns = 3_600_000_000_000
    real = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: real() + hour_ns)
    error = refusal(source)
    assert error.code == "stale_picture"
    assert "did not ask for" in str(error)
    monkeypatch.setattr(time, "time_ns", real)
    assert np.array_equal(source.take().grey, scene.last)


def test_a_camera_that_falls_silent_is_gone(serve, opened):
    scene = Scene()
    scene.frames = {2: {"silent": True}}
    camera = serve(scene)
    source = opened(patience_s=LATE_S)
    source.take()
    error = refusal(source)
    assert error.code == "camera_gone"
    assert "Aravis Fake" in str(error)
    assert refusal(source).code == "camera_gone"
    source.close()
    camera.close()
    with pytest.raises(CalibrationError, match="does not answer") as caught:
        open_gige(ADDRESS)
    assert caught.value.code == "camera_gone"


def test_a_camera_that_was_switched_off_and_on_is_gone(serve, opened):
    scene = Scene()
    camera = serve(scene)
    source = opened(patience_s=LATE_S)
    source.take()
    camera.close()
    serve(scene)
    assert refusal(source).code == "camera_gone"


def test_ctrl_c_during_an_exposure_releases_the_camera(serve, opened):
    scene = Scene()
    scene.frames = {1: {"slow_s": 20.0}}
    camera = serve(scene)
    source = opened(patience_s=20.0)

    def press():
        while not scene.taken:
            time.sleep(0.01)
        _thread.interrupt_main()

    presses = threading.Thread(target=press)
    presses.start()
    with pytest.raises(KeyboardInterrupt):
        source.take()
    presses.join()
    assert camera.read_register(PRIVILEGE) == 0
    assert camera.read_register(TRIGGER_MODE) == 0


@pytest.mark.parametrize("number", [0x01080009, 0x01100007], ids=["BayerRG8", "Mono16"])
def test_other_formats_are_read_as_they_are_set(serve, opened, number):
    scene = Scene()
    camera = serve(scene)
    camera.write_register(PIXEL_FORMAT, number)
    grey = opened().take().grey
    sent = scene.last.tobytes().ljust(scene.last.size * (number >> 16 & 0xFF) // 8, b"\0")
    assert np.array_equal(grey, grey_pixels(sent, number, scene.size_px))
    assert camera.read_register(PIXEL_FORMAT) == number


def test_a_format_that_cannot_be_read_is_named(serve, opened):
    camera = serve(Scene())
    camera.write_register(PIXEL_FORMAT, 0x02180014)
    error = refusal(opened())
    assert error.code == "picture_unreadable"
    assert "RGB8" in str(error)


def test_a_picture_that_cannot_be_drawn_is_not_sent(serve, opened):
    def broken():
        raise ZeroDivisionError

    camera = serve(broken)
    assert refusal(opened(patience_s=0.3)).code == "picture_late"
    assert isinstance(camera.failed, ZeroDivisionError)


def test_two_cameras_cannot_be_served_at_one_address(serve):
    serve(Scene())
    with pytest.raises(ConnectError, match="port 3956"):
        GigeCamera(Scene(), (64, 48))


@pytest.mark.parametrize(
    ("address", "error", "told"),
    [
        ("192.0.2.1", ConfigError, "other machines"),
        ("localhost", ConfigError, "not an address for a GigE camera"),
        ("127.0.0.77", ConnectError, "port 3956"),
    ],
)
def test_a_camera_at_an_odd_address_is_refused(library, address, error, told):
    with pytest.raises(error, match=told):
        GigeCamera(Scene(), (64, 48), address=address)


def test_pictures_leave_nothing_behind(serve, opened):
    """A buffer is 77 kB: if each was kept, the memory would grow by 15 MB."""
    serve(Scene())
    source = opened()
    for _ in range(20):
        source.take()
    before = resident_bytes()
    for _ in range(200):
        source.take()
    assert resident_bytes() - before < 7e6


def test_an_opened_camera_leaves_no_thread_behind(serve):
    serve(Scene((64, 48)))
    open_gige(ADDRESS).close()
    before = threads()
    for _ in range(5):
        source = open_gige(ADDRESS)
        source.take()
        source.close()
    assert threads() <= before


@pytest.mark.soak
def test_five_hundred_opened_cameras_leave_nothing_behind(serve):
    serve(Scene())
    for at in range(550):
        if at == 50:
            before = resident_bytes(), threads()
        source = open_gige(ADDRESS)
        source.take()
        source.close()
    assert resident_bytes() - before[0] < 20e6  # a camera's description alone is 0.5 MB
    assert threads() == before[1]


def resident_bytes() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def threads() -> int:
    with open("/proc/self/status") as file:
        return int(next(line for line in file if line.startswith("Threads:")).split()[1])


def test_the_library_is_loaded_only_for_a_camera():
    """Importing the modules, as a command does that lists sensors, loads nothing."""
    code = (
        "import robolink.eye.cameras.gige.opening, sys; "
        "print('aravis-0' in open('/proc/self/maps').read(), 'numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


@pytest.mark.parametrize("name", ["libno-such-library.so", "libc.so.6"])
def test_a_library_that_is_missing_or_too_old_is_named(monkeypatch, name):
    monkeypatch.setattr(binding, "_NAMES", {sys.platform: (name,)})
    binding.aravis.cache_clear()
    try:
        with pytest.raises(ConfigError, match="Aravis") as caught:
            open_gige(ADDRESS)
    finally:
        binding.aravis.cache_clear()
    assert "nstall" in caught.value.remedy


ONE = FoundCamera("192.168.1.20", ("Basler-acA1300-22334455", "22334455", "00:30:53:aa:bb:cc"))
OTHER = FoundCamera("192.168.1.21", ("Basler-acA1300-66778899", "66778899", "00:30:53:dd:ee:ff"))


@pytest.mark.parametrize("name", ["22334455", "basler-ACA1300-22334455", "00:30:53:AA:BB:CC"])
def test_a_camera_is_known_by_each_of_its_names(name):
    assert located(name, (OTHER, ONE)) == "192.168.1.20"


def test_the_only_camera_needs_no_name():
    assert located("", (ONE,)) == "192.168.1.20"
    with pytest.raises(ConfigError, match=re.escape("66778899 (192.168.1.21)")):
        located("", (ONE, OTHER))


def test_a_camera_that_does_not_answer_by_its_name_is_gone():
    for camera, there, told in (("1", (ONE,), "acA1300-22334455"), ("1", (), "1"), ("", (), "No")):
        with pytest.raises(CalibrationError, match=told) as caught:
            located(camera, there)
        assert caught.value.code == "camera_gone"


BY_NAME = """
import numpy as np
from robolink.eye.cameras.gige.opening import open_gige
from robolink_simulators.pictures.gige_camera import GigeCamera, GigeFrame
grey = np.full((48, 64), 7, np.uint8)
with GigeCamera(lambda: GigeFrame(grey), (64, 48), serial="RL-77") as camera:
    for name in ("", "rl-77", "Aravis-Fake-RL-77"):
        source = open_gige(name)
        print(source.identity, source.take().grey.mean())
        source.close()
"""


@pytest.mark.soak
def test_a_camera_is_found_by_a_broadcast(library):
    """In a network of its own, so that no real camera is asked; needs root."""
    where = ["unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$0" -c "$1"']
    ran = subprocess.run(
        [*where, sys.executable, BY_NAME], capture_output=True, text=True, check=False
    )
    if "unshare" in ran.stderr:
        pytest.skip(f"no network namespace here: {ran.stderr.strip()}")
    assert ran.stdout.splitlines() == ["gige Aravis Fake RL-77 7.0"] * 3, ran.stderr
