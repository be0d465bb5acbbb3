"""Wait for a condition, times after which bits switch back, and what Sense looks at."""

import math
import socket
from urllib.parse import urlsplit

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

NS_PER_S = 1_000_000_000


@pytest.fixture
def simulator():
    return EpsonSimulator(options=EpsonOptions(remote_timeout_s=0))


@pytest.fixture
def client(simulator, login):
    return login(simulator)


def begin(client, statement):
    """Send a statement that is not over at once."""
    assert client.ask(f'$Execute,"{statement}"') == ""


@pytest.mark.parametrize(
    "condition", ["Sw(1) = On", "Sw(1)", "Sw(1) <> 0", "In(0) Mask 2 = 2", "Sw(1) Or Sw(2)"]
)
def test_a_wait_for_an_input_ends_when_it_is_switched_and_not_before(simulator, client, condition):
    begin(client, f"Wait {condition}; Print TW")
    assert client.wait(3600) == ""
    simulator.panel.switch_input(1, True)
    assert client.wait(0.001) == '#Execute,"0\r\n"'


def test_a_wait_for_a_condition_is_no_time_in_seconds(client):
    """Evaluated as a number, ``Sw(1) = On`` is 0 and ``Sw(1) = Off`` is one second."""
    begin(client, "Wait Sw(1) = On")
    assert client.wait(10) == ""
    client.ask("$Abort")
    assert client.ask('$Execute,"Wait Sw(1) = Off"') == "#Execute,0"


def test_a_wait_with_a_time_ends_with_it_and_tw_tells(simulator, client):
    began_ns = simulator.now_ns
    begin(client, "Wait Sw(1) = On, 5; Print TW")
    assert client.wait(4.999) == ""
    assert client.wait(0.001) == '#Execute,"-1\r\n"'
    assert simulator.now_ns - began_ns == 5 * NS_PER_S
    begin(client, "Wait Sw(1) = On, 5; Print TW")
    client.wait(1)
    simulator.panel.switch_input(1, True)
    assert client.wait(0.001) == '#Execute,"0\r\n"'


def test_tmout_limits_a_wait_without_a_time_and_is_error_2280(simulator, client):
    assert client.ask('$Execute,"TMOut 2"') == "#Execute,0"
    begin(client, "Wait MemSw(9) = On")
    assert client.wait(1.999) == ""
    assert client.wait(0.001) == "!Execute,99"
    assert client.code() == 2280
    client.ask("$Reset")
    begin(client, "Wait MemSw(9) = On, 3")
    assert client.wait(3) == "#Execute,0"


def test_a_restart_forgets_tmout_and_stored_conditions(simulator, client, login):
    client.ask('$Execute,"TMOut 2; Till Sw(5) = On"')
    simulator.restart()
    again = login(simulator)
    assert again.ask('$Execute,"TMOut"') == '#Execute,"0\r\n"'
    assert again.ask('$Execute,"Till"') == '#Execute,"Sw(0) = On\r\n"'


def test_a_wait_on_a_socket_ends_when_the_input_is_switched():
    simulator = EpsonSimulator()
    with serve_tcp(simulator) as host:
        address = urlsplit(host.url)
        with socket.create_connection((address.hostname, address.port), timeout=5) as client:
            client.sendall(b'$Login,\r\n$Execute,"Wait Sw(1) = On"\r\n')
            assert client.recv(100) == b"#Login,0\r\n"
            client.settimeout(0.05)
            with pytest.raises(TimeoutError):
                client.recv(100)
            client.settimeout(5)
            simulator.panel.switch_input(1, True)
            assert client.recv(100) == b"#Execute,0\r\n"


def test_memory_that_the_host_sets_meanwhile_ends_a_wait(client):
    begin(client, "Wait MemSw(7) = On")
    assert client.wait(60) == ""
    client.send("$SetMemIO,7,1")
    assert "#Execute,0" in client.wait(0.01)


def test_an_aborted_wait_leaves_no_error(client):
    begin(client, "Wait Sw(1) = On")
    assert client.flags() == "00100000010"
    assert "!Execute,99" in client.ask("$Abort")
    assert client.flags() == "00100000001"


def test_an_emergency_stop_ends_a_wait(simulator, client):
    begin(client, "Wait Sw(1) = On")
    simulator.panel.press_estop()
    assert client.heard() == "!Execute,99"
    assert client.code() == 4025


def test_an_output_that_is_on_for_a_time_switches_back(simulator, client):
    begin(client, "On 11, 0.5; Print Oport(11)")
    assert simulator.machine.outputs.get(11)
    assert client.wait(0.499) == ""
    assert client.wait(0.001) == '#Execute,"0\r\n"'
    assert client.ask('$Execute,"On 12, 0.5, 0; Print Oport(12)"') == '#Execute,"1\r\n"'
    client.wait(0.499)
    assert simulator.machine.outputs.get(12)
    client.wait(0.001)
    assert not simulator.machine.outputs.get(12)


def test_a_timed_off_of_what_is_off_switches_on(simulator, client):
    assert client.ask('$Execute,"Off 3, 0.2, 0"') == "#Execute,0"
    client.wait(0.2)
    assert simulator.machine.outputs.get(3)


def test_a_wait_sees_an_output_switch_back(simulator, client):
    client.ask('$Execute,"On 12, 0.5, 0"')
    began_ns = simulator.now_ns
    begin(client, "Wait Oport(12) = Off")
    assert client.wait(0.6) == "#Execute,0"
    assert simulator.now_ns >= began_ns
    assert not simulator.machine.outputs.get(12)


def test_a_reset_forgets_what_was_to_switch_on(simulator, client):
    client.ask('$Execute,"Off 3, 5, 0"')
    client.ask("$Reset")
    client.wait(10)
    assert not simulator.machine.outputs.get(3)


def test_sense_is_looked_at_once_before_the_descent(simulator, client):
    machine = simulator.machine
    client.ask('$Execute,"P1 = Here -X(20); Sense Sw(3) = On"')
    begin(client, "Jump P1 Sense; Print JS")
    highest_mm = machine.tip().z_mm
    while machine.tip().z_mm >= highest_mm:
        highest_mm = machine.tip().z_mm
        assert client.wait(0.005) == ""
    simulator.panel.switch_input(3, True)  # too late: the descent has begun
    assert client.wait(60) == '#Execute,"0\r\n"'
    low_mm = machine.tip().z_mm
    begin(client, "Jump P1 +X(5) Sense; Print JS")
    assert client.wait(60) == '#Execute,"-1\r\n"'
    assert machine.tip().z_mm > low_mm + 10


def test_an_arc_runs_on_the_circle_through_its_points(simulator, client):
    client.ask('$Execute,"P1 = Here -X(10) -Y(10); P2 = Here -X(20)"')
    start = simulator.machine.tip()
    centre = (start.x_mm - 10, start.y_mm)
    begin(client, "Arc P1, P2")
    lowest = start.y_mm
    while not client.wait(0.02):
        tip = simulator.machine.tip()
        assert math.dist(centre, (tip.x_mm, tip.y_mm)) == pytest.approx(10, abs=1e-6)
        lowest = min(lowest, tip.y_mm)
    assert lowest == pytest.approx(start.y_mm - 10, abs=0.1)
    assert simulator.machine.tip().x_mm == pytest.approx(start.x_mm - 20)


def test_places_of_a_pallet_run_along_the_first_side(client):
    client.ask('$Execute,"P0 = XY(0,400,-100,0); P1 = XY(20,400,-100,0); P2 = XY(0,410,-100,0)"')
    client.ask('$Execute,"Pallet 1, P0, P1, P2, 3, 2"')
    for place, x, y in (("1", 0, 400), ("2", 10, 400), ("4", 0, 410), ("3, 2", 20, 410)):
        said = client.ask(f'$Execute,"Print CX(Pallet(1, {place})), CY(Pallet(1, {place}))"')
        assert said == f'#Execute,"{x} {y}\r\n"'
    client.ask('$Execute,"P3 = XY(24,414,-100,0); Pallet 2, P0, P1, P2, P3, 3, 3"')
    assert client.ask('$Execute,"Print CX(Pallet(2, 2, 2))"') == '#Execute,"11\r\n"'
    assert client.ask('$Execute,"Print CX(Pallet(1, 7))"') == "!Execute,99"


def test_home_goes_where_homeset_says_over_the_wire_too(simulator, client):
    assert client.ask("$Home,1") == "!Home,99"
    assert client.code() == 2228
    client.ask("$Reset")
    client.ask('$Execute,"HomeSet 102400, 136533, -300000, -100000"')
    assert client.ask("$Home,1") == ""
    assert client.wait(60) == "#Home,0"
    assert client.ask('$Execute,"Print AtHome"') == '#Execute,"-1\r\n"'


def test_speed_factor_makes_a_motion_slower(simulator, client):
    def duration_ns(statement):
        began_ns = simulator.now_ns
        begin(client, statement)
        while not client.wait(0.001):
            pass
        return simulator.now_ns - began_ns

    plain = duration_ns("Move Here -X(10)")
    client.ask('$Execute,"SpeedFactor 25"')
    assert duration_ns("Move Here +X(10)") > 1.9 * plain
