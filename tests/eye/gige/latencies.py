"""How long opening a GigE camera takes, its pictures and its refusals, for docs/reference/eye.md.

python -m tests.eye.gige.latencies
"""

import re
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

from robolink_simulators.pictures.gige_camera import GigeCamera, fake_description

from robolink.errors import CalibrationError
from robolink.eye.cameras.gige.opening import open_gige
from tests.eye.gige._scene import ADDRESS, Scene
from tests.eye.gige.conftest import alone

SIZE_PX = (1280, 960)
ROUNDS = 20


def main() -> None:
    """Measure, and print a line for each."""
    with alone():
        for packet_bytes in (1_400, 8_000):
            _pictures(packet_bytes)
        _started()
        _refusals()


def _pictures(packet_bytes: int) -> None:
    scene = Scene(SIZE_PX)
    with GigeCamera(scene, SIZE_PX, packet_bytes=packet_bytes):
        opened, first, closed = list[float](), list[float](), list[float]()
        for _ in range(ROUNDS):
            begun_s = time.perf_counter()
            source = open_gige(ADDRESS)
            opened.append(1000 * (time.perf_counter() - begun_s))
            first.append(_ms(source.take))
            closed.append(_ms(source.close))
        source = open_gige(ADDRESS)
        source.take()
        before, cpu_s = scene.taken, time.process_time()
        further = [_ms(source.take) for _ in range(5 * ROUNDS)]
        cpu_s = time.process_time() - cpu_s
        again = scene.taken - before - len(further)
        source.close()
    told = f"{SIZE_PX[0]} x {SIZE_PX[1]}, packets of {packet_bytes} bytes"
    _print(f"open ({told})", opened)
    _print("first picture", first)
    _print("further picture", further)
    print(f"  CPU of both ends {1000 * cpu_s / len(further):.1f} ms each, begun anew {again} times")
    _print("close", closed)


def _started() -> None:
    """A camera without a software trigger is started for each picture."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "camera.xml"
        without = re.sub(
            r'<(\w+) Name="TriggerSoftware".*?</\1>', "", fake_description(), flags=re.DOTALL
        )
        path.write_text(without)
        with GigeCamera(Scene(SIZE_PX), SIZE_PX, description=str(path)):
            source = open_gige(ADDRESS)
            _print("picture without a software trigger", [_ms(source.take) for _ in range(ROUNDS)])
            source.close()


def _refusals() -> None:
    scene = Scene((160, 120))
    with GigeCamera(scene, (160, 120), packet_bytes=500) as camera:
        with camera.held_by_another():
            _refused("another program has it", lambda: open_gige(ADDRESS))
        for name, fault in (
            ("packets lost", {"lost": 0.5}),
            ("no picture", {"slow_s": 60.0}),
            ("silent during a picture", {"silent": True}),
        ):
            scene.frames = {}
            source = open_gige(ADDRESS)
            source.take()
            scene.frames = {scene.taken + at: fault for at in range(1, 4)}
            _refused(name, source.take)
            _print("  close", [_ms(source.close)])
    _refused("nobody there", lambda: open_gige(ADDRESS))


def _refused(name: str, does: Callable[[], object]) -> None:
    begun_s = time.perf_counter()
    try:
        does()
    except CalibrationError as error:
        print(f"{name}: {error.code} after {time.perf_counter() - begun_s:.2f} s")


def _ms(does: Callable[[], object]) -> float:
    begun_s = time.perf_counter()
    does()
    return 1000 * (time.perf_counter() - begun_s)


def _print(name: str, times_ms: list[float]) -> None:
    ordered = sorted(times_ms)
    p95 = ordered[int(0.95 * (len(ordered) - 1))]
    print(f"{name}: median {median(ordered):.1f} ms, p95 {p95:.1f}, least {ordered[0]:.1f}")


if __name__ == "__main__":
    main()
