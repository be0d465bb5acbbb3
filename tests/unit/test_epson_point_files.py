"""Point files of EPSON RC+: what is read, and what is refused with a sentence."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError
from robolink.model import Elbow, Hand, Pose, Posture, Wrist
from robolink.pose_tables import parse_pts, read_poses, read_pts


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
@settings(max_examples=60, deadline=None)
def test_rubbish_gives_points_or_a_sentence(text):
    try:
        parse_pts(text)
    except ConfigError:
        return
    assert "nNumberOfPoints=0" in text
