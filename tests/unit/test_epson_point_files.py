"""Files of poses: what is read, and what is refused with a sentence."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import CalibrationError, ConfigError
from robolink.model import Hand, Pose
from robolink.pose_tables import parse_pts, read_poses, read_pts

GOOD = [
    {"x_mm": 287.5, "y_mm": 103.25, "u_deg": 0},
    {"x_mm": -312.5, "y_mm": 96.75, "u_deg": 180.0, "z_mm": -20, "hand": "right"},
]
POSES = (
    Pose(287.5, 103.25, 0.0, 0.0),
    Pose(-312.5, 96.75, -20.0, 180.0, hand=Hand.RIGHT),
)


def written(folder, name, text, encoding="utf-8"):
    path = folder / name
    path.write_text(text, encoding=encoding)
    return path


def test_json_is_read(tmp_path):
    assert read_poses(written(tmp_path, "a.json", json.dumps(GOOD))) == POSES


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_csv_is_read_in_any_order_of_columns(tmp_path, encoding, newline):
    rows = ["u_deg, hand,x_mm,z_mm,y_mm", "0,,287.5,,103.25", "", "180,Right,-312.5,-20,96.75"]
    path = written(tmp_path, "A.CSV", newline.join(rows), encoding)
    assert read_poses(path) == POSES


BROKEN = {
    "a.txt": "x_mm,y_mm,u_deg\n1,2,3",
    "b.json": "[",
    "c.json": '{"x_mm": 1}',
    "d.json": '[{"x_mm": 1, "y_mm": 2}]',
    "e.json": '[{"x_mm": 1, "y_mm": 2, "u_deg": 3, "tool": 1}]',
    "f.json": '[{"x_mm": 1, "y_mm": 2, "u_deg": 3, "hand": "middle"}]',
    "g.json": "[1, 2]",
    "h.json": "[" * 100_000,
    "a.csv": "",
    "b.csv": "x,y,u\n1,2,3",
    "c.csv": "x_mm;y_mm;u_deg\n1,5;2;3",
    "d.csv": "x_mm,y_mm,u_deg\n1,2",
    "e.csv": "x_mm,y_mm,u_deg,x_mm\n1,2,3,4",
    "f.csv": "x_mm,y_mm,u_deg\n1,,3",
    "g.csv": 'x_mm,y_mm,u_deg\n"1,2,3',
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_laid_out_otherwise_is_refused_by_name(tmp_path, name):
    path = written(tmp_path, name, BROKEN[name])
    with pytest.raises(ConfigError, match=name) as caught:
        read_poses(path)
    assert caught.value.remedy


@pytest.mark.parametrize("value", ["NaN", "Infinity", "null", '"abc"', "true", "[1]", "1e999"])
def test_what_is_no_finite_number_is_named(tmp_path, value):
    text = f'[{{"x_mm": 1, "y_mm": 2, "u_deg": 3}}, {{"x_mm": 1, "y_mm": 2, "u_deg": {value}}}]'
    with pytest.raises(CalibrationError, match="Pose 2 has u_deg") as caught:
        read_poses(written(tmp_path, "a.json", text))
    assert caught.value.code == "non_finite"


def test_a_missing_a_binary_and_a_huge_file_are_refused(tmp_path):
    (tmp_path / "b.json").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "c.json").write_bytes(b" " * 4_000_001)
    for name in ("a.json", "b.json", "c.json"):
        with pytest.raises(ConfigError, match=name):
            read_poses(tmp_path / name)


FINITE = st.floats(-999, 999).map(lambda value: round(value, 3) + 0.0)


@given(st.lists(st.tuples(FINITE, FINITE, FINITE), max_size=4))
@settings(max_examples=30, deadline=None)
def test_csv_keeps_every_number(tmp_path_factory, values):
    rows = ["x_mm,y_mm,u_deg", *(f"{x:.3f},{y:.3f},{u:.3f}" for x, y, u in values)]
    path = written(tmp_path_factory.getbasetemp(), "kept.csv", "\n".join(rows))
    assert [(p.x_mm, p.y_mm, p.u_deg) for p in read_poses(path)] == values


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
