"""Points as Print shows them, and point files of RC+."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.model import Elbow, Hand, Pose, Posture, Wrist
from robolink.pose_tables import parse_pts, read_poses, read_pts
from robolink.protocols.spel import PrintedPoint, format_point, parse_point
from tests._rows import each_row

# Points as Print shows them.

CAPTURE = " X: -182.632 Y:  240.114 Z:  -20.002 U:  -36.156 V:    0.000 W:    0.000 /R /0"
SEEN = (-182.632, 240.114, -20.002, -36.156, 0.0, 0.0)

VALUES = st.integers(-9_999_999, 9_999_999).map(lambda thousandths: thousandths / 1000)
HANDS = st.sampled_from([None, *Hand])
POINTS = st.builds(
    PrintedPoint.of,
    st.one_of(st.tuples(*[VALUES] * 4), st.tuples(*[VALUES] * 6)),
    hand=HANDS,
    local=st.integers(0, 15),
)


def test_the_real_capture_is_read_and_written_again():
    point = parse_point(CAPTURE)
    assert point == PrintedPoint(SEEN, Hand.RIGHT, ("R", "0"), 0)
    assert point == PrintedPoint.of(SEEN, hand=Hand.RIGHT)
    assert format_point(point) == CAPTURE


@each_row(
    ("text", "point"),
    [
        (
            "X: 0.100 Y: 300.450 Z: -20.000 U: 0.000 /R /0\r\n",
            PrintedPoint((0.1, 300.45, -20.0, 0.0), Hand.RIGHT, ("R", "0"), 0),
        ),
        (
            " X: 350.000 Y:-100.000 Z: -20.000 U:-136.156 /L /3",
            PrintedPoint((350.0, -100.0, -20.0, -136.156), Hand.LEFT, ("L", "3"), 3),
        ),
        (
            "X:1 Y:2 Z:3 U:4 V:5 W:6 /R /A /NF /J4F0 /J1A(-12.5) /0",
            PrintedPoint(
                (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
                Hand.RIGHT,
                ("R", "A", "NF", "J4F0", "J1A(-12.5)", "0"),
                0,
                Posture(j1_angle_deg=-12.5),
            ),
        ),
        ("X:1 Y:2 Z:3 U:4/L/15", PrintedPoint((1.0, 2.0, 3.0, 4.0), Hand.LEFT, ("L", "15"), 15)),
        ("X:1 Y:2 Z:3 U:4", PrintedPoint((1.0, 2.0, 3.0, 4.0))),
        ("X:1 Y:2 Z:3 U:4 /N /0", PrintedPoint((1.0, 2.0, 3.0, 4.0), None, ("N", "0"), 0)),
    ],
)
def test_other_widths_and_flags_are_read(text, point):
    assert parse_point(text) == point


@each_row(
    "text",
    [
        "",
        "0",
        "X: 1 Y: 2 Z: 3",
        "X: 1 Y: 2 Z: 3 U: 4 V: 5 /R /0",
        "Y: 1 X: 2 Z: 3 U: 4 /R /0",
        "X: 1 Y: 2 Z: 3 U: nan /R /0",
        "X: 1 Y: 2 Z: 3 U: \uff11 /R /0",
        "X: 1_0 Y: 2 Z: 3 U: 4 /R /0",
        "X: 1 2 Y: 2 Z: 3 U: 4 /R /0",
        "X: 1 Y: 2 Z: 3 U: 4 /R /L /0",
        "X: 1 Y: 2 Z: 3 U: 4 /R /0 /1",
        "X: 1 Y: 2 Z: 3 U: 4 /R /16",
        "X: 1 Y: 2 Z: 3 U: 4 /R /0 junk",
        "X: 1 Y: 2 Z: 3 U: 4 /" + "9" * 5000,
        f"{CAPTURE}\r\n{CAPTURE}",
    ],
)
def test_anything_else_is_no_point(text):
    with pytest.raises(RemoteProtocolError) as caught:
        parse_point(text)
    assert caught.value.raw == text.encode()


@settings(max_examples=60, deadline=None)
@given(POINTS, st.sampled_from([9, 8]))
def test_a_point_reads_back_as_it_was_written(point, width):
    if len(point.coordinates) == 6:
        text = format_point(point, coordinates="six", width=width)
    else:
        text = format_point(point, coordinates="four", width=width)
    assert parse_point(text) == point


def test_six_columns_pad_a_point_of_four_and_four_cut_one_of_six():
    four = PrintedPoint.of((1.0, 2.0, 3.0, 4.0))
    six = PrintedPoint.of((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert parse_point(format_point(four)).coordinates == (1.0, 2.0, 3.0, 4.0, 0.0, 0.0)
    assert parse_point(format_point(six, coordinates="four")) == four


def test_the_narrow_layout_squeezes_out_the_blank():
    point = PrintedPoint.of((350.0, -100.0, 0.0, 0.0), hand=Hand.LEFT)
    assert (
        format_point(point, coordinates="four", width=8)
        == " X: 350.000 Y:-100.000 Z:   0.000 U:   0.000 /L /0"
    )


# Point files of EPSON RC+: what is read, and what is refused with a sentence.


def written(folder, name, text, encoding="utf-8"):
    path = folder / name
    path.write_text(text, encoding=encoding)
    return path


def block(index, number, *, undefined=0, hand=1, local=0, **coordinates):
    values = dict.fromkeys("XYZUVWRST", 0) | coordinates
    lines = [f"nNumber={number}", 'sLabel="caf\xe9 } {"', 'sDescription=""']
    lines += [f"nUndefined={undefined}"]
    lines += [f"r{axis}={value}" for axis, value in values.items()]
    lines += [f"nLocal={local}", f"nHand={hand}", "nElbow=1", "bSimVisible=False"]
    return "\n".join([f"Point{index} {{", *(f"\t{line}" for line in lines), "}"])


def pts(*blocks):
    head = ["ENVT0100,LM:,DS:,CS:,MA:,EI:           ", 'sVersion="2.0.0"', "bDisplayR=False"]
    return "\n".join([*head, f"nNumberOfPoints={len(blocks)}", *blocks, ""])


def test_a_point_file_is_read(tmp_path):
    text = pts(
        block(1, 0, X=88.952, Y=233.345, Z=-20.062, U=-101.024),
        block(2, 7, X=-25, U="1E-03", hand=2, local=3, undefined=448),
        block(3, 8, undefined=262143),
    )
    path = tmp_path / "robot1.pts"
    path.write_bytes(text.replace("\n", "\r\n").encode("cp1252"))
    assert read_pts(path) == {
        0: Pose(88.952, 233.345, -20.062, -101.024, hand=Hand.RIGHT),
        7: Pose(-25.0, 0.0, 0.0, 0.001, hand=Hand.LEFT, local=3),
        8: None,
    }


def test_a_point_file_is_a_file_of_poses_too(tmp_path):
    text = pts(block(1, 7, X=88.952, U=-101.024, hand=2, local=3), block(2, 8, undefined=262143))
    found = read_poses(written(tmp_path, "robot1.pts", text))
    (entry,) = found.entries
    assert (entry.name, entry.number, entry.line, found.how.skipped) == ("caf\xe9 } {", 7, 5, 1)
    assert entry.pose == Pose(88.952, 0.0, 0.0, -101.024, hand=Hand.LEFT, local=3)
    assert "local" in entry.stated


def test_the_angle_of_a_singular_place_is_read_from_a_point_file():
    angles = "\trJ1Angle=57.5\n\trJ4Angle=0\n}"
    there, away = block(1, 1, U=87), block(2, 2, U=87)
    poses = parse_pts(pts(there[:-1] + angles, away[:-1] + angles.replace("57.5", "0")))
    told, untold = poses[1], poses[2]
    assert told is not None
    assert told.posture == Posture(j1_angle_deg=57.5)
    assert untold is not None
    assert untold.posture is None


def test_the_posture_of_a_six_axis_robot_is_read_from_a_point_file():
    flags = "\tnWrist=2\n\tnJ1Flag=1\n\tnJ4Flag=1\n\tnJ6Flag=-2\n}"
    there = block(1, 1, V=10)[:-1].replace("nElbow=1", "nElbow=2") + flags
    pose = parse_pts(pts(there))[1]
    assert pose is not None
    assert pose.posture == Posture(
        elbow=Elbow.BELOW, wrist=Wrist.FLIP, j1_flag=1, j4_flag=1, j6_flag=-2
    )


def test_an_empty_point_file_has_no_points():
    assert parse_pts(pts()) == {}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "P1 = XY(1, 2, 3, 4)",
        pts(block(1, 0)).replace("nNumberOfPoints=1", "nNumberOfPoints=2"),
        pts(block(1, 0)).replace("\trX=0\n", ""),
        pts(block(1, 0)).replace("rX=0", "rX=abc"),
        pts(block(1, 4), block(2, 4)),
    ],
)
def test_anything_else_is_no_point_file(tmp_path, text):
    path = written(tmp_path, "robot1.pts", text)
    with pytest.raises(ConfigError, match=r"robot1\.pts"):
        read_pts(path)


@given(st.text(max_size=200) | st.text("Point1 {}\n=nr0NXYZU", max_size=200))
@settings(max_examples=30, deadline=None)
def test_rubbish_gives_points_or_a_sentence(text):
    try:
        parse_pts(text)
    except ConfigError:
        return
    assert "nNumberOfPoints=0" in text
