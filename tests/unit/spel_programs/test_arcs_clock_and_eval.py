"""Arc and Arc3 in all forms, counters of inputs, the clock, and Eval."""

import math

import pytest

NS = 1_000_000_000


@pytest.fixture
def travelled(cell):
    """Return where the tip was on the way of one motion, from Here at (x, y, z) on."""

    def run(motion):
        made = cell(f"Function main\nP0 = Here\n{motion}\nFend\n")
        machine = made.simulator.machine
        start = machine.tip().coordinates()[:3]
        made.runner.start("main", 0)
        places = []
        while made.runner.tasks and made.simulator.now_ns < 100 * NS:
            made.simulator.advance(made.simulator.now_ns + 20_000_000)
            places.append(machine.tip().coordinates()[:3])
        assert made.runner.failure is None, made.runner.failure
        return [tuple(a - b for a, b in zip(place, start, strict=True)) for place in places]

    return run


@pytest.mark.parametrize(
    ("motion", "centre", "farthest"),
    [
        # From (0, 0): the chord is 20 mm toward -X. Which side the way bulges to tells its sense.
        ("Arc P0 -X(10) +Y(10), P0 -X(20)", (-10, 0), (-10, 10)),
        ("Arc P0 -X(20), 180", (-10, 0), (-10, 10)),
        ("Arc P0 -X(20), -180", (-10, 0), (-10, -10)),
        ("Arc P0 -X(20), -90", (-10, 10), (-10, 10 - math.sqrt(200))),
        ("Arc P0 -X(20), 10, ARC_SHORT, ARC_PLUS", (-10, 0), (-10, 10)),
        ("Arc P0 -X(20), 26, ARC_SHORT, ARC_MINUS", (-10, 24), (-10, -2)),
        ("Arc P0 -X(20), 26, ARC_LONG, ARC_MINUS", (-10, -24), (-10, -50)),
        ("Arc P0 -X(20), P0 -X(10) -Y(24), ARC_SHORT", (-10, -24), (-10, 2)),
        ("Arc P0 -X(20), P0 -X(10) -Y(24), ARC_LONG", (-10, -24), (-10, -50)),
        ("Real a\na = 180\nArc P0 -X(20), a", (-10, 0), (-10, 10)),
    ],
)
def test_an_arc_runs_on_its_circle_in_its_sense(travelled, motion, centre, farthest):
    places = travelled(motion)
    radius = math.hypot(*centre)
    assert {round(math.dist(centre, place[:2]), 4) for place in places} == {round(radius, 4)}
    assert places[-1] == pytest.approx((-20, 0, 0), abs=1e-6)
    nearest = min(math.dist(place[:2], farthest) for place in places)
    assert nearest < radius * 0.1


@pytest.mark.parametrize(
    "motion",
    [
        "Arc3 P0 -X(10) -Z(10), P0 -X(20)",
        "Arc3 P0 -X(10) -Z(10), P0 -X(10), ARC_SHORT\nArc3 P0 -X(20), P0 -X(10), ARC_SHORT",
    ],
)
def test_an_arc_in_space_takes_the_height_of_its_mid_point(travelled, motion):
    places = travelled(motion)
    assert {round(math.dist((-10, 0, 0), place), 4) for place in places} == {10}
    assert min(z for _, _, z in places) == pytest.approx(-10, abs=0.1)
    assert places[-1] == pytest.approx((-20, 0, 0), abs=1e-6)


def test_an_arc_of_six_axes_by_its_angle(login):
    from robolink_simulators.epson import EpsonOptions, EpsonSimulator

    simulator = EpsonSimulator("C8-C901S", options=EpsonOptions(remote_timeout_s=0))
    client = login(simulator)
    for statement in ("P0 = Here", "Arc P0 -X(20), 180", "Arc3 P0, P0 -X(10), ARC_LONG"):
        reply = client.ask(f'$Execute,"{statement}"') or client.wait(60)
        # Opposite ends tell no plane: which way round is not said.
        assert reply == ("!Execute,99" if "Arc3" in statement else "#Execute,0")
    assert client.ask('$Execute,"Print Dist(P0, Here)"').startswith(("!", "#"))


@pytest.mark.parametrize(
    "arc",
    [
        "Arc P0 -X(20), 0",
        "Arc P0 -X(20), 360",
        "Arc P0, 90",
        "Arc P0 -X(20), 9.9, ARC_SHORT, ARC_PLUS",
        "Arc P0 -X(20), P0 -X(5), ARC_SHORT",
        "Arc P0 -X(20), P0 -X(10), ARC_SHORT",
        "Arc3 P0 -X(10), P0 -X(20)",
    ],
)
def test_what_is_no_circle_is_refused_before_anything_moves(cell, arc):
    made = cell(f"Function main\nP0 = Here\n{arc}\nFend\n")
    made.run()
    assert made.runner.failure.number == made.simulator.options.numbers.value_out_of_range
    assert made.simulator.machine.arm.moves_started == 0


@pytest.mark.parametrize("arc", ["Arc P0, 1, 2", "Arc 5, P0", "Arc P0", "Arc3 P0, 90"])
def test_what_is_no_form_of_an_arc_is_refused(failure, arc):
    assert failure("P0 = Here", arc).number == 2100


def test_a_counter_counts_how_often_an_input_comes_on(cell):
    """P. 257: 16 counters, rising edges."""
    made = cell(
        "Function main\nCTReset 3\nWait 1\nPrint Ctr(3), Ctr(4)\nCTReset 3\nPrint Ctr(3)\nFend\n"
    )
    made.runner.start("main", 0)
    made.simulator.advance(NS // 2)
    for on in (True, True, False, True, False, True):
        made.simulator.panel.switch_input(3, on)
        made.simulator.panel.switch_input(4, on)
    made.simulator.advance(2 * NS)
    assert "".join(made.runner.console).split("\r\n")[:2] == ["3 0", "0"]


def test_a_counter_ends_a_wait_and_there_are_sixteen(cell, failure):
    made = cell("Function main\nCTReset 3\nWait Ctr(3) >= 2, 5\nPrint TW\nFend\n")
    made.runner.start("main", 0)
    for on in (True, False, True):
        made.simulator.advance(made.simulator.now_ns + NS // 10)
        made.simulator.panel.switch_input(3, on)
    made.simulator.advance(NS)
    assert list(made.runner.console) == ["0\r\n"]
    told = failure("Integer i", "For i = 0 To 16", "CTReset i", "Next")
    assert told.number == 2507


def test_the_clock_goes_with_simulated_time(printed):
    """P. 277, 834."""
    lines = ("Print Date$", "Print Time$", "Wait 75", "Print Time$", "Date", "Time")
    shown = printed(*lines)
    assert shown == ["2026/01/01", "08:00:00", "08:01:15", "2026/01/01", "08:01:15"]


def test_eval_runs_a_line_of_the_command_window_and_never_fails(printed):
    """P. 316."""
    lines = (
        "String r$",
        "Integer e",
        'Print Eval("Print 2 + 3", r$), r$',
        'e = Eval("Go P900", r$)',
        "Print e",
        "Print r$",
        'Print Eval("For i = 1 To 3", r$)',
        'Print Eval("P1 = Here; TLSet 3, XY(1, 2, 3, 4)"), TLDef(3)',
        'Print Eval("Go Here -X(30); Print 7", r$), r$, Dist(P1, Here) > 29.9',
        'Eval "Speed 30"',
        "Print Speed(1)",
        'Print Eval("Print Space$(255)", r$), Len(r$)',
    )
    shown = printed(*lines)
    assert shown == [
        "05",
        "7007",
        "!Error: 7007",
        "2353",
        "0 -1",
        "07 -1",
        "30",
        "0 255",
    ]
