"""Tables of poses: columns, units, separators and encodings; and twenty real tables."""

import json
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robolink.calibration import rotation_of
from robolink.errors import AmbiguousPosesError, CalibrationError, ConfigError
from robolink.model import Hand, Pose
from robolink.pose_tables import RULES, ReadingChoices, read_poses
from robolink.pose_tables.orientation import order_for
from tests._rows import each_row

# Tables of poses: columns, units, separators and encodings; what is asked, what is refused.

FLAT = (Pose(287.5, 103.25, -50.0, 90.0), Pose(-12.25, 87.5, -50.0, -45.0))
TILTED = (444.235, -60.394, 247.269, 40.0, 12.0, -172.0)
QUATERNION = ["0.029526803", "-0.934762234", "-0.332466138", "0.121712777"]  # the scalar first


@pytest.fixture
def read(tmp_path):
    def of(content, name="poses.txt", *, needs=(), **choices):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_poses(path, ReadingChoices(**choices), needs=needs)

    return of


def matrix_of(pose):
    angles = (pose.u_deg, pose.v_deg, pose.w_deg)
    return Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()


def same(found, *expected):
    """Compare place and rotation; angles are not unique."""
    assert len(found.poses) == len(expected)
    for pose, numbers in zip(found.poses, expected, strict=True):
        place, angles = numbers[:3], numbers[3:]
        assert pose.coordinates()[:3] == pytest.approx(place, abs=1e-6)
        turned = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
        assert np.allclose(matrix_of(pose), turned, atol=1e-6)


LAYOUTS = {
    "commas": "x,y,z,u\n287.5,103.25,-50,90\n-12.25,87.5,-50,-45\n",
    "own names": "u_deg, x_mm,z_mm,y_mm\n90,287.5,-50,103.25\n\n-45,-12.25,-50,87.5\n",
    "units in brackets": "X [mm];Y (mm);Z/mm;U [°]\n287,5;103,25;-50;90\n-12,25;87,5;-50;-45\n",
    "centimetres": "X [cm];Y [cm];Z [cm];U [deg]\n28,75;10,325;-5;90\n-1,225;8,75;-5;-45\n",
    "quotes": 'x,y,z,u\n"287,5","103,25","-50","90"\n"-12,25","87,5","-50","-45"\n',
    "tabs": "X\tY\tZ\tU\n287,5\t103,25\t-50\t90\n-12,25\t87,5\t-50\t-45\n",
    "blanks": "  x   y  z  u\n287.5 103.25 -50 90\n -12.25  87.5 -50 -45  # good\n",
    "blanks and commas": "x y z u\n287,5 103,25 -50,0 90,0\n-12,25 87,5 -50,0 -45,0\n",
    "a line of units": "X,Y,Z,U,Remark\nmm,mm,mm,deg,\n287.5,103.25,-50,90,a\n"
    "-12.25,87.5,-50,-45,b\n",
    "a title": "Station 4\n\nX;Y;Z;U\n287,5;103,25;-50;90\n-12,25;87,5;-50;-45\n",
    "a header in a comment": "# x y z u\n287.5 103.25 -50 90\n-12.25 87.5 -50 -45\n",
    "an index": ",x,y,z,u\n0,287.5,103.25,-50,90\n1,-12.25,87.5,-50,-45\n",
    "comments": "; by hand\n! so\n// and\nx;y;z;u;\n287.5;103.25;-50;90;\n-12.25;87.5;-50;-45;\n",
    "a typographic minus": "x;y;z;u\n287,5;103,25;\u221250;90\n"
    "\u221212,25;87,5;\u221250;\u221245\n",
    "what a spreadsheet is told": "sep=;\nX;Y;Z;U\n287,5;103,25;-50;90\n-12,25;87,5;-50;-45\n",
    "two numbers, two names": "No,ID,Name,Point,x,y,z,u\n1,7,a,b,287.5,103.25,-50,90\n"
    "2,8,c,d,-12.25,87.5,-50,-45\n",
    "names of two words between semicolons": "Name ; X ; Y ; Z ; U\n"
    "Pin 1 ; 287,5 ; 103,25 ; -50 ; 90\nPin 2 ; -12,25 ; 87,5 ; -50 ; -45\n",
    "names of two words between tabs": "Name\tX\tY\tZ\tU\nPin 1\t287.5\t103.25\t-50\t90\n"
    "Pin 2\t-12.25\t87.5\t-50\t-45\n",
    "bars": "| x | y | z | u |\n| 287.5 | 103.25 | -50 | 90 |\n| -12.25 | 87.5 | -50 | -45 |\n",
    "about Z alone": "x,y,z,rz\n287.5,103.25,-50,90\n-12.25,87.5,-50,-45\n",
    "names and values": "Pin 1: X=287.5 mm Y=103.25 mm Z=-50 mm U=90 deg\n"
    "Pin 2: X=-12.25 mm Y=87.5 mm Z=-50 mm U=-45 deg\n",
}


@each_row("layout", LAYOUTS)
def test_a_table_is_read_whatever_its_layout(read, layout):
    assert read(LAYOUTS[layout]).poses == FLAT


ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252"]


NEWLINES = ["\n", "\r\n", "\r"]


@pytest.mark.parametrize(
    ("encoding", "newline"),
    [
        # Each encoding with one of them, in turn.
        pytest.param(encoding, newline, marks=() if number % 3 == place else pytest.mark.soak)
        for number, encoding in enumerate(ENCODINGS)
        for place, newline in enumerate(NEWLINES)
    ],
)
def test_a_table_is_read_in_whatever_encoding(read, encoding, newline):
    text = "Name;X [mm];Y [mm];Z [mm];U [°]\nNädel;287,5;103,25;-50;90\nb;-12,25;87,5;-50;-45\n"
    found = read(text.replace("\n", newline).encode(encoding))
    assert found.poses == FLAT
    assert [entry.name for entry in found.entries] == ["Nädel", "b"]


def test_what_else_a_line_says_is_kept(read):
    text = "no;point;x;y;z;u;hand;tool;local\n7;a 1;287.5;103.25;-50;90;L;2;1\n8;;1;2;3;40;;;\n"
    first, second = read(text).entries
    assert (first.number, first.name, first.line) == (7, "a 1", 2)
    assert first.pose == Pose(287.5, 103.25, -50.0, 90.0, hand=Hand.LEFT, local=1, tool=2)
    assert second.pose == Pose(1.0, 2.0, 3.0, 40.0)
    assert "local" in first.stated
    assert "local" not in second.stated


def quaternion_table(header, order, scale=1.0):
    numbers = [f"{value * scale:.9g}" for value in TILTED[:3]]
    return f"{header}\n{','.join([*numbers, *(QUATERNION[place] for place in order)])}\n"


@each_row(
    ("text", "choices"),
    [
        (quaternion_table("x,y,z,qw,qx,qy,qz", (0, 1, 2, 3)), {}),
        (quaternion_table("X [m],Y [m],Z [m],qx,qy,qz,qw", (1, 2, 3, 0), 0.001), {}),
        (quaternion_table("x,y,z,w,qx,qy,qz", (0, 1, 2, 3)), {}),
        (quaternion_table("#", (1, 2, 3, 0)), {"columns": "x,y,z,qx,qy,qz,qs"}),
        (quaternion_table("x,y,z,qx,qy,qz,qw", (1, 2, 3, 0), 0.001), {"length": "m"}),
        (quaternion_table("x,y,z,qx,qy,qz,qw", (1, 2, 3, 0), 1 / 25.4), {"length": "in"}),
        (
            "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,"
            "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
            f"field.pose.orientation.w\n1700000000,0.444235,-0.060394,0.247269,"
            f"{','.join(QUATERNION[place] for place in (1, 2, 3, 0))}\n",
            {},
        ),
    ],
)
def test_a_quaternion_has_its_scalar_where_its_name_stands(read, text, choices):
    same(read(text, **choices), TILTED)


EULER = {
    "epson": ("ZYX", "u v w"),
    "kuka": ("ZYX", "a b c"),
    "fanuc": ("ZYX", "r p w"),
    "xyzrpw": ("ZYX", "w p r"),
    "codesys": ("ZYZ", "a b c"),
    "mitsubishi": ("ZYX", "c b a"),
    "motoman": ("ZYX", "rz ry rx"),
    "staubli": ("XYZ", "rx ry rz"),
    "kawasaki": ("ZYZ", "o a t"),
}


@pytest.mark.fault("F40")
@each_row("name", EULER)
def test_each_rule_is_the_product_of_the_matrices_that_its_name_stands_for(read, name):
    axes, letters = EULER[name]
    angles = dict(zip(letters.split(), (40.0, 12.0, -172.0), strict=True))
    turned = Rotation.from_euler(axes, tuple(angles.values()), degrees=True)
    for order in (sorted(angles), sorted(angles, reverse=True)):  # columns in any order
        header = ",".join(["x", "y", "z", *order])
        row = ",".join(["10", "20", "30", *(str(angles[letter]) for letter in order)])
        found = read(f"{header}\n{row}\n", euler=name)
        assert np.allclose(matrix_of(found.poses[0]), turned.as_matrix(), atol=1e-12)
    assert set(EULER) | {"rotvec"} == set(RULES)


def test_a_rotation_vector_is_in_radians_unless_its_name_says_degrees(read):
    vector = Rotation.from_euler("ZYX", TILTED[3:], degrees=True).as_rotvec()
    for unit, scale in (("", 1.0), ("_deg", 180 / np.pi), ("_rad", 1.0)):
        header = ",".join(["x,y,z", *(f"{name}{unit}" for name in ("rx", "ry", "rz"))])
        row = ",".join(f"{value:.12g}" for value in (*TILTED[:3], *(vector * scale)))
        same(read(f"{header}\n{row}\n", euler="rotvec"), TILTED)


ASKED = {
    "no header": ("1.5 20 -3 40\n", "columns"),
    "an unknown column of numbers": ("x,y,z,u,theta\n1,20,3,40,15\n2,20,3,40,-1\n", "columns"),
    "q1 to q4": (f"x,y,z,q1,q2,q3,q4\n1,20,3,{','.join(QUATERNION)}\n", "columns"),
    "V without W": ("x,y,z,u,v\n1,20,3,40,0\n", "columns"),
    "not a rotation": ("x,y,z\n1,20,3\n", "columns"),
    "two rotations": ("x,y,z,u,qx,qy,qz,qw\n1,20,3,40,0,0,0,1\n", "columns"),
    "radians or degrees": ("x,y,z,u\n1,20,3,1.5707963\n", "columns"),
    "radians in a comment": ("# radians\nx,y,z,u\n1,20,3,40\n", "columns"),
    "roll pitch yaw of two makers": ("x,y,z,r,p,w\n1,20,3,40,5,6\n", "euler"),
    "the same the other way round": ("x,y,z,w,p,r\n1,20,3,40,5,6\n", "euler"),
    "in words": ("x,y,z,roll,pitch,yaw\n1,20,3,40,5,6\n", "euler"),
    "vector or angles": ("x,y,z,rx,ry,rz\n1,20,3,3,0,0\n", "euler"),
    "A B C of three makers": ("x,y,z,a,b,c\n1,20,3,40,5,6\n", "euler"),
    "metres or mm": ("x,y,z,u\n0.2875,0.10325,-0.05,90\n", "length"),
    "inches in a comment": ("# all in inches\nx,y,z,u\n11.3,4.06,-1.97,90\n", "length"),
    "both": ("x,y,z,r,p,w\n0.4,0.1,0.2,180,0,0\n", "euler,length"),
    "a mm of ROS": (
        '[{"position": {"x": 405, "y": 1, "z": 2},'
        ' "orientation": {"x": 1, "y": 0, "z": 0, "w": 0}}]',
        "length",
    ),
    "a matrix as nine and three": ("1 0 0 0 -1 0 0 0 -1 405.8 -62.9 251.6\n", "columns"),
    "rows of JSON": ("[[1, 20, 3, 40]]", "columns"),
}


@each_row("case", ASKED)
def test_what_a_file_does_not_say_is_asked_and_not_guessed(read, case):
    text, about = ASKED[case]
    with pytest.raises(AmbiguousPosesError, match=r"poses\.txt") as caught:
        read(text)
    assert caught.value.reason == about
    assert caught.value.asks == tuple(about.split(","))
    for which in caught.value.asks:
        assert which in caught.value.remedy


REFUSED = {
    "": "no pose in it",
    "x,y,z,u\n": "no pose in it",
    "x,y,z,u,x\n1,2,3,4,5\n": "line 1: two columns say x",
    "x,y,z,u\n1,20,3,40\n1,20,3\n": "line 3: it has 3 columns, but 4 are named",
    "x,y,z,u\n1,20,3,40\n1,20,3,40,5\n": "line 3: it has 5 columns",
    "x,y,z,u\n1,,3,40\n": "line 2: there is no y",
    "x,y,z,u\n287,5,103,25,-50,0,90,0\n": "line 2: it has 8 columns",
    "x;y;z;u\n287.5;103,25;-50;90\n": "do not have the same columns",
    "x [mm],y [m],z,u\n1,20,3,40\n": "lengths have different units",
    "x [ft],y [ft],z [ft],u\n1,20,3,40\n": "unit that is not known",
    "x,y,z,u_deg,v_rad,w_deg\n1,20,3,40,5,6\n": "angles have different units",
    "x,y,z,qx,qy,qz,qw\n1,20,3,0,0,0,2\n": "line 2: the quaternion has the length 2",
    "x,y,u,hand\n1,20,30,middle\n": "other than right or left",
    "x,y,u,tool\n1,20,30,1.5\n": "tool is not a whole number",
    "j1,j2,j3,j4\n10,20,30,40\n": "joint angles are not a pose",
    "y,z,u\n10,20,30\n": "it has no line",
    '"x,y,u\n1,2,3\n': "",
    "1 0 0 5\n0 1 0 6\n0 0 -1 7\n0 0 0 1\n": "left-handed",
    "1 0 0 5\n0 1 0 6\n0 0.1 1 7\n0 0 0 1\n": "line 1: the matrix is not a rotation",
    "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n": "in the last line and in the last column",
    "<pose><x>1</x></pose>\n": "no pose in it",
    '{"x_mm": 1}': "no pose in it",
    "[1, 2]": "",
    "[" * 100_000: "",
    '[{"x_mm": 1, "y_mm": 2, "u_deg": 3, "hand": "middle"}]': "pose 1: its hand",
    "a: " * 2000 + "\n": "",
    "p:\n" + "".join(f"{' ' * depth}- \n" for depth in range(1, 200)): "",
}


@each_row("text", REFUSED)
def test_a_file_that_is_no_list_of_poses_is_refused_with_its_line(read, text):
    with pytest.raises(ConfigError, match=r"poses\.txt") as caught:
        read(text)
    assert REFUSED[text] in caught.value.what
    assert caught.value.remedy


@pytest.mark.fault("F37")
@pytest.mark.parametrize("value", ["NaN", "inf", "1e999", "here"])
def test_what_is_no_finite_number_is_named_with_its_line(read, value):
    with pytest.raises(CalibrationError, match="line 3: y is") as caught:
        read(f"x,y,z,u\n1,20,3,40\n2,{value},3,50\n3,20,3,60\n")
    assert caught.value.code == "non_finite"


@each_row("value", ["NaN", "Infinity", '"abc"', "true", "1e999"])
def test_in_json_it_is_named_with_its_pose(read, value):
    text = f'[{{"x_mm": 1, "y_mm": 2, "u_deg": 3}}, {{"x_mm": 1, "y_mm": 2, "u_deg": {value}}}]'
    with pytest.raises(CalibrationError, match="pose 2: u_deg is"):
        read(text)


@each_row(
    ("text", "choices", "why"),
    [
        ("x_mm,y_mm,u_deg\n1,20,3\n", {"length": "m"}, "it says mm itself"),
        ("P1 = XY(1, 2, 3, 4)\n", {"columns": "x,y"}, "columns were given"),
        ("P1 = XY(1, 2, 3, 4)\n", {"euler": "codesys"}, "are defined as R = Rz(U) Ry(V) Rx(W)"),
        ("x,y,z,qx,qy,qz,qw\n1,20,3,0,0,0,1\n", {"euler": "kuka"}, "the file has no angles"),
        ("x,y,z,o,a,t\n1,20,3,40,5,6\n", {"euler": "fanuc"}, "angles of fanuc are called R, P, W"),
        ("x,y,z,a,b,c\n1,20,3,40,5,6\n", {"euler": "nobody"}, "is not a rule for angles"),
        ("x,y,z,a,b,c\n1,20,3,40,5,6\n", {"euler": "xxy"}, "is not a rule for angles"),
        ("1 2 3 4\n", {"columns": "x,y,z,turn"}, "is not the name of a column"),
        ("1 2 3 4\n", {"columns": "x,y,z,z"}, "two columns say z"),
        ("1 2 3 40 5\n", {"columns": "x,y,z,u"}, "line 1: it has 5 columns, but 4 are named"),
        ("1 2 3 40\n", {"columns": "x,y,z,u", "length": "yard"}, "is not a unit of length"),
    ],
)
def test_what_a_person_says_may_not_contradict_the_file(read, text, choices, why):
    with pytest.raises(ConfigError, match="poses") as caught:
        read(text, **choices)
    assert why in caught.value.what


def test_a_person_names_columns_units_and_rules(read):
    text = "0.2875 0.10325 -0.05 1.5707963267948966 9\n"
    same(read(text, columns="x_m,y_m,z_m,u_rad,-"), (287.5, 103.25, -50.0, 90.0, 0.0, 0.0))
    row = "405.8,-62.9,251.6,40,12,-172\n"
    by_product = read(row, columns="x,y,z,a,b,c", euler="RzRyRx")
    same(by_product, (405.8, -62.9, 251.6, 40.0, 12.0, -172.0))
    over_header = read(f"X,Y,Z,R,P,W\n{row}", columns="x,y,z,u,v,w")
    same(over_header, (405.8, -62.9, 251.6, 40.0, 12.0, -172.0))


def test_a_pose_has_to_state_what_is_needed(read):
    text = "x,y,z,u\n1,20,3,40\n"
    assert read(text, needs=["z_mm"]).poses[0].z_mm == 3.0
    with pytest.raises(ConfigError, match="pose 1: there is no V, W, which is needed here"):
        read(text, needs=["z_mm", "v_deg", "w_deg"])
    with pytest.raises(ConfigError, match="there is no Z"):
        read("x,y,u\n1,20,40\n", needs=["z_mm"])


def test_a_missing_a_binary_and_a_huge_file_are_refused(tmp_path):
    (tmp_path / "b.txt").write_bytes(b"\x89PNG\r\n\x00\x00\x01")
    with (tmp_path / "c.txt").open("wb") as file:
        file.truncate(32_000_001)
    for name, why in (("a.txt", "No such file"), ("b.txt", "not text"), ("c.txt", "32 MB")):
        with pytest.raises(ConfigError, match=name) as caught:
            read_poses(tmp_path / name)
        assert why in caught.value.what


def test_a_rounded_matrix_is_the_rotation_nearest_to_it(read):
    turned = Rotation.from_euler("ZYX", TILTED[3:], degrees=True).as_matrix()
    rows = [" ".join([*(f"{v:.3f}" for v in row), "405.8"]) for row in turned]
    (pose,) = read("\n".join([*rows, "0 0 0 1", ""])).poses
    assert np.allclose(matrix_of(pose), turned, atol=6e-4)


NUMBERS = st.floats(-800, 800).map(lambda value: round(value, 3) + 0.0)
ANGLES = st.floats(-179, 179).map(lambda value: round(value, 3) + 0.0)
POSES = st.tuples(NUMBERS.filter(lambda x: abs(x) > 10), NUMBERS, NUMBERS, ANGLES, ANGLES, ANGLES)


def written(rows, form):
    """Return rows of poses in one of the usual forms, and the options needed."""
    if form == "json":
        names = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
        return json.dumps([dict(zip(names, row, strict=True)) for row in rows]), {}
    if form == "spel":
        lines = [f"P{n} = XY({', '.join(map(str, row))}) /R /0" for n, row in enumerate(rows)]
        return "\n".join(lines), {}
    if form == "kuka":
        pairs = [", ".join(f"{n} {v}" for n, v in zip("XYZABC", row, strict=True)) for row in rows]
        return "\n".join(f"DECL POS P{n}={{{one}}}" for n, one in enumerate(pairs)), {}
    if form == "matrices":
        blocks = []
        for *place, u, v, w in rows:
            turned = Rotation.from_euler("ZYX", (u, v, w), degrees=True).as_matrix()
            whole = np.vstack([np.column_stack([turned, place]), [0, 0, 0, 1]])
            blocks.append("\n".join(" ".join(f"{x:.12g}" for x in line) for line in whole))
        return "\n\n".join(blocks), {}
    separator, decimal = {"semicolons": (";", ","), "tabs": ("\t", "."), "blanks": ("  ", ".")}[
        form
    ]
    lines = [separator.join(str(value).replace(".", decimal) for value in row) for row in rows]
    return "\n".join([separator.join("XYZABC"), *lines]), {"euler": "kuka"}


@pytest.mark.parametrize(
    "form", ["json", "spel", "kuka", "matrices", "semicolons", "tabs", "blanks"]
)
@given(rows=st.lists(POSES, min_size=1, max_size=4))
@settings(max_examples=15, deadline=None)
def test_what_is_written_in_any_form_is_read_back(tmp_path_factory, form, rows):
    path = tmp_path_factory.getbasetemp() / f"kept-{form}.txt"
    text, choices = written(rows, form)
    path.write_text(text, encoding="utf-8")
    try:
        found = read_poses(path, ReadingChoices(**choices))
    except AmbiguousPosesError:
        # Small angles may be radians: then robolink asks, and reads nothing.
        assert all(abs(angle) < 6.3 for row in rows for angle in row[3:])
        return
    same(found, *rows)


@given(st.text(max_size=120) | st.text("xyzu,;\t\n 0.5-[]{}:#P=XY()", max_size=120))
@settings(max_examples=60, deadline=None)
def test_rubbish_gives_poses_or_a_sentence(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "rubbish.txt"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with suppress(ConfigError, CalibrationError):  # anything else is a defect
        assert read_poses(path).entries


# Twenty real tables, unedited, with the poses that they stand for.
# They are not part of the source archive; the tests skip where the folder is absent.

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "pose_tables"
LIST = DATA / "expected.json"
EXPECTED = json.loads(LIST.read_text(encoding="utf-8"))["files"] if LIST.is_file() else {}


@pytest.mark.skipif(
    not LIST.is_file(), reason="the tables lie beside the repository and are not there"
)
@each_row("name", EXPECTED)
def test_a_table_holds_the_poses_that_it_stands_for(name):
    wanted = EXPECTED[name]
    found = read_poses(DATA / name, ReadingChoices(**wanted["options"]))
    assert len(found.entries) == len(wanted["poses"])
    for entry, one in zip(found.entries, wanted["poses"], strict=True):
        pose = entry.pose
        place = (pose.x_mm, pose.y_mm, pose.z_mm)
        assert place == pytest.approx((one["x"], one["y"], one["z"]), abs=1e-6)
        assert np.allclose(rotation_of(pose).ravel(), one["r"], rtol=0, atol=1e-6)
        known = {
            "name": entry.name,
            "number": entry.number,
            "hand": pose.hand,
            "local": pose.local,
            "tool": pose.tool,
        }
        for key in known.keys() & one.keys():
            assert known[key] == one[key]


@pytest.mark.skipif(
    not LIST.is_file(), reason="the tables lie beside the repository and are not there"
)
@pytest.mark.parametrize("name", [name for name in EXPECTED if EXPECTED[name]["options"]])
def test_without_what_it_does_not_say_a_table_is_refused_with_that_question(name):
    with pytest.raises(AmbiguousPosesError) as caught:
        read_poses(DATA / name)
    assert set(caught.value.asks) == set(EXPECTED[name]["options"])


@each_row(
    ("rule", "letters", "order"),
    [
        ("epson", "c a b", (1, 2, 0)),  # another maker's letters, from the first matrix to the last
        ("kuka", "w u v", (1, 2, 0)),
        ("mitsubishi", "u v w", None),
        ("epson", "r p w", None),
    ],
)
def test_letters_of_another_maker_count_where_their_order_is_plain(rule, letters, order):
    assert order_for(RULES[rule], letters.split()) == order
