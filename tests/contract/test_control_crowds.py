"""Many control clients at once, on simulators that other clients use at the same time."""

import os
import random
import socket
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from robolink_simulators.cell.clock import SteeredClock
from robolink_simulators.control.acts import ACTS
from robolink_simulators.control.cell import AnySimulator, ControlledCell
from robolink_simulators.control.client import ControlClient
from robolink_simulators.control.server import ControlServer
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.hosting.fieldbus.modbus import serve_modbus_tcp
from robolink_simulators.hosting.streams.epson import serve_tcp
from robolink_simulators.plc import PlcSimulator, serve_plc
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.errors import ConfigError, RobolinkError
from robolink.register_maps import load_map

MAP = Path(__file__).parents[2] / "examples/plc-maps/commit-bit.toml"
PATIENCE_S = 60.0


@pytest.fixture
def served(monkeypatch, tmp_path):
    """Simulators of all kinds on their ports, and one control port; no thread may fail."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    failed: list[object] = []
    monkeypatch.setattr(threading, "excepthook", lambda args: failed.append(args.exc_value))
    epson, softmotion = EpsonSimulator("T6-602S,C8-C901S", seed=3), SoftMotionSimulator(seed=3)
    plc = PlcSimulator(load_map(MAP), seed=3)
    clocks = [SteeredClock(20) for _ in range(3)]
    with ExitStack() as stack:
        urls = (
            stack.enter_context(serve_tcp(epson, clock=clocks[0])).url,
            stack.enter_context(serve_modbus_tcp(softmotion, clock=clocks[1])).url,
            stack.enter_context(serve_plc(plc, MAP, clock=clocks[2])).url,
        )
        simulators: tuple[AnySimulator, ...] = (epson, softmotion, plc)
        cells = {
            simulator.kind: ControlledCell(simulator, clock, {"tcp": url})
            for simulator, clock, url in zip(simulators, clocks, urls, strict=True)
        }
        yield stack.enter_context(ControlServer(cells))
    assert failed == []


def together(*works):
    """Run all of them at once, each in a thread; return the results."""
    given = [None] * len(works)

    def do(number):
        given[number] = works[number]()

    threads = [threading.Thread(target=do, args=(number,)) for number in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert not any(thread.is_alive() for thread in threads)
    return given


def some(taken, rng):
    """Return a value that an act accepts."""
    match taken.form:
        case "whole":
            least, most = taken.whole_limits
            return rng.choice((least, rng.randint(least, min(most, 40)), most))
        case "number" if taken.name == "seconds":
            return rng.choice((0, 1, 600, 86_400))
        case "number":
            return rng.choice([it for it in (0, 1, 0.5, 10) if taken.least <= it <= taken.most])
        case "flag":
            return rng.random() < 0.5
        case "text" if taken.choices:
            return rng.choice(taken.choices)
        case _:
            return rng.choice(("a", "b", "GetStatus"))


@pytest.mark.parametrize("each", [20, pytest.param(1000, marks=pytest.mark.soak)])
def test_every_act_is_answered_whatever_others_do_at_the_same_time(served, each):
    done = threading.Event()

    def act(seed):
        """Run random acts; a defect or a missing answer ends the thread with an error."""
        rng, refused = random.Random(seed), 0
        for _ in range(each // 20):
            kind = rng.choice(sorted(ACTS))
            with ControlClient(served.url_of(kind), timeout_s=PATIENCE_S) as control:
                for _ in range(20):
                    name = rng.choice(sorted(ACTS[kind]))
                    takes = [it for it in ACTS[kind][name].takes if it.needed or rng.random() < 0.1]
                    given = {it.name: some(it, rng) for it in takes}
                    try:
                        control.do(name, **given)
                    except ConfigError:
                        refused += 1
        return refused

    def use(kind):
        """Write tools as the real driver does, however often it is disconnected."""
        tries = 0
        while not done.is_set():
            tries += 1
            try:
                with robolink.connect(served.cells[kind].urls["tcp"], timeout_s=1.0) as controller:
                    controller.tools.write(2, ToolOffset(tries, 2, -30), expected=robolink.ANY)
            except RobolinkError:
                continue
        return tries

    def acts():
        try:
            return together(*(lambda seed=seed: act(seed) for seed in range(12)))
        finally:
            done.set()

    refused, *tries = together(acts, lambda: use("epson"), lambda: use("softmotion"))
    assert None not in refused
    assert all(tries)
    for kind in ACTS:
        with ControlClient(served.url_of(kind)) as control:
            control.do("reset")
            assert control.do("counters")["starts"] == 1


def test_no_step_of_one_client_is_lost_in_that_of_another(served):
    with ControlClient(served.url_of("epson")) as control:
        control.do("set_clock", factor=0)
        before_s = control.do("clock")["simulated_s"]

        def step():
            with ControlClient(served.url_of("epson")) as another:
                return [another.do("step", seconds=1.0)["simulated_s"] for _ in range(20)]

        told = sorted(at_s for steps in together(*[step] * 6) for at_s in steps)
        assert told == pytest.approx([before_s + number for number in range(1, 121)])
        assert control.do("clock")["simulated_s"] == pytest.approx(before_s + 120)


def test_what_was_restored_is_whole_whoever_looks(served):
    """Each snapshot follows a write of two tools in one step; no client sees only one of them."""
    simulator = served.cells["epson"].simulator
    with ControlClient(served.url_of("epson")) as control:
        for name, x_mm in (("a", 1.0), ("b", 2.0)):
            with simulator.acting():
                for tool in (2, 3):
                    simulator.machine.tools.set(tool, ToolOffset(x_mm, 0, 0))
            control.do("snapshot", name=name)

    def go(name):
        with ControlClient(served.url_of("epson")) as one:
            for _ in range(40):
                one.do("restore", name=name)

    def look():
        with ControlClient(served.url_of("epson")) as one:
            looks = [one.do("truth")["stored"] for _ in range(80)]
        return {stored["2"]["x_mm"] - stored["3"]["x_mm"] for stored in looks}

    assert together(lambda: go("a"), lambda: go("b"), look, look)[2:] == [{0.0}, {0.0}]


def test_one_who_asks_while_it_ends_is_answered_or_cut_off(served):
    began = threading.Barrier(5)

    def ask():
        with ControlClient(served.url_of("epson"), timeout_s=PATIENCE_S) as control:
            control.do("counters")
            began.wait(PATIENCE_S)
            try:
                for _ in range(10_000):
                    control.do("truth")
            except RobolinkError as error:
                return type(error).__name__

    def end():
        began.wait(PATIENCE_S)
        served.close()

    *ends, _ = together(*[ask] * 4, end)
    assert set(ends) <= {"TransportBrokenError", "ConnectError"}


def open_files():
    return len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0


@pytest.mark.parametrize("times", [200, pytest.param(10_000, marks=pytest.mark.soak)])
def test_threads_and_files_of_those_who_left_come_back(served, times):
    parts = urlsplit(served.url)
    before = threading.active_count(), open_files()
    begun = (b"", b"G", b"GET / HTTP/1.1\r\n\r\n", b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\n{")
    for number in range(times):
        with socket.create_connection((parts.hostname, parts.port), 10) as connection:
            connection.sendall(begun[number % len(begun)])
    ends = time.monotonic() + PATIENCE_S
    while (threading.active_count(), open_files()) != before:
        assert time.monotonic() < ends
        time.sleep(0.01)
