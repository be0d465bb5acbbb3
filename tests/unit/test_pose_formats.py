"""Poses in third-party programs and messages, made here as their makers write them."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robolink.errors import AmbiguousPosesError, CalibrationError, ConfigError
from robolink.model import Hand
from robolink.pose_tables import ReadingChoices, read_poses
from tests._rows import each_row

PLACE, ANGLES = (405.8, -62.9, 251.6), (40.0, 12.0, -172.0)
TURNED = Rotation.from_euler("ZYX", ANGLES, degrees=True)
XYZW = [f"{value:.9f}" for value in TURNED.as_quat()]
VECTOR = [f"{value:.9f}" for value in TURNED.as_rotvec()]
METRES = [f"{value / 1000:.7f}" for value in PLACE]
TARGET = f"[[405.8,-62.9,251.6],[{XYZW[3]},{','.join(XYZW[:3])}],[0,-1,0,0],[9E+09,9E+09]]"
KUKA = "{X 405.8,Y -62.9,Z 251.6,A 40.0,B 12.0,C -172.0,S 2,T 35}"
ROWS = [
    " ".join([*(f"{value:.9f}" for value in row), str(place)])
    for row, place in zip(TURNED.as_matrix(), PLACE, strict=True)
]
MATRIX = [*([float(word) for word in row.split()] for row in ROWS), [0, 0, 0, 1]]
COLUMNS = [
    *("\t".join([*(f"{v:.9f}".replace(".", ",") for v in c), "0"]) for c in TURNED.as_matrix().T),
    "405,8\t-62,9\t251,6\t1",
]
ROS = (
    f"position:\n  x: {METRES[0]}\n  y: {METRES[1]}\n  z: {METRES[2]}\n"
    f"orientation:\n  x: {XYZW[0]}\n  y: {XYZW[1]}\n  z: {XYZW[2]}\n  w: {XYZW[3]}\n"
)
FLOW = (
    f"position: {{x: {METRES[0]}, y: {METRES[1]}, z: {METRES[2]}}}\n"
    f"  orientation: {{x: {XYZW[0]}, y: {XYZW[1]}, z: {XYZW[2]}, w: {XYZW[3]}}}\n"
)
FANUC = (
    "P[{n}:\"{name}\"]{{\n   GP1:\n\tUF : 2, UT : 3,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
    "\tX =   405.800  mm,\tY =   -62.900  mm,\tZ =   251.600  mm,\n"
    "\tW =  -172.000 deg,\tP =    12.000 deg,\tR =    40.000 deg\n}};\n"
)


def indented(text, by):
    return "".join(f"{by}{line}\n" for line in text.splitlines())


@pytest.fixture
def read(tmp_path):
    def of(text, name="poses.txt", **choices):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return read_poses(path, ReadingChoices(**choices))

    return of


FORMS = {
    "KUKA declaration": f"&REL 1\n;FOLD x\nDECL E6POS XPIN={KUKA}\n",
    "KUKA frame": f"DECL FRAME F={KUKA}\n",
    "KUKA movement": f"PTP {KUKA}\n",
    "KUKA aggregate": f"LIN {KUKA.replace('{X', '{E6POS: X')}\n",
    "KUKA beside tools": f"$TOOL={KUKA}\nTOOL_DATA[1]={KUKA}\n$BASE={KUKA}\nDECL POS XP={KUKA}\n",
    "ABB target": f"MODULE M\n  CONST robtarget p1:={TARGET};\nENDMODULE\n",
    "ABB movement": f"MoveL {TARGET},v100,fine,tool0;\n! {TARGET}\n",
    "ABB print": f"{TARGET}\n",
    "ABB array": f"CONST robtarget p{{1}}:=[{TARGET}];\n",
    "ABB pose": f"VAR pose p1:=[[405.8,-62.9,251.6],[{XYZW[3]},{','.join(XYZW[:3])}]];\n"
    "PERS tooldata t1:=[TRUE,[[1,2,3],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n",
    "FANUC": FANUC.format(n=1, name="pin 1"),
    "FANUC registers": "[*POSREG*]$POSREG  Storage: CMOS  : ARRAY[1,9] OF Position Reg\n"
    "     [1,1] =   'pin 1' \n  Group: 1   Config: F U T, 0, 0, 0\n"
    "  X:   405.800   Y:   -62.900   Z:   251.600\n"
    "  W:  -172.000   P:    12.000   R:    40.000\n     [1,2] =   ''  Uninitialized\n",
    "URScript name": f"  global pin_1=p[{', '.join([*METRES, *VECTOR])}]\n",
    "URScript movement": "set_tcp(p[0,0,0.1,0,0,0])\nq=[0,1,2,3,4,5]\n"
    f"movel(p[{','.join([*METRES, *VECTOR]).replace('0.', '.')}], a=1.2)\n",
    "URScript with units": "p[405.8mm, -62.9mm, 251.6mm, {}]\n".format(", ".join(VECTOR)),
    "SPEL+": "P1 = XY(  405.800,  -62.900,  251.600,   40.000,   12.000, -172.000 ) /R /A /0\n",
    "SPEL+ print": " X:  405.800 Y:  -62.900 Z:  251.600 U:   40.000 V:   12.000 W: -172.000 /R\n",
    "ROS pose": ROS,
    "ROS stamped": f"header:\n  stamp:\n    sec: 1\n  frame_id: base\npose:\n"
    f"{indented(ROS, '  ')}---\n",
    "ROS array": f"header:\n  seq: 1\nposes:\n- {FLOW}",
    "ROS transform": "transforms:\n- child_frame_id: t\n  transform:\n"
    + indented(ROS.replace("position", "translation").replace("orientation", "rotation"), "    "),
    "ROS odometry": f"pose:\n  pose:\n{indented(ROS, '    ')}  covariance: [0.0, 0.1]\n"
    "twist:\n  twist:\n    linear:\n      x: 0.0\n      y: 0.0\n      z: 0.0\n",
    "blocks": "\n".join([*ROWS, "0 0 0 1", ""]),
    "blocks of three": "\n".join([*ROWS, ""]),
    "blocks by columns": "\n".join([*COLUMNS, ""]),
    "numpy": "[[" + "]\n [".join([*ROWS, "0. 0. 0. 1."]) + "]]\n",
    "one line": " ".join([*ROWS, "0 0 0 1"]) + "\n",
    "one line of three": ";".join(ROWS).replace(" ", ";").replace(".", ",") + "\n",
    "one line by columns": " ".join(COLUMNS).replace("\t", " ").replace(",", ".") + "\n",
    "JSON matrix": json.dumps({"poses": [{"name": "a", "T": MATRIX}]}),
    "JSON message": json.dumps(
        {
            "pose": {
                "position": dict(zip("xyz", map(float, METRES), strict=True)),
                "orientation": dict(zip("xyzw", map(float, XYZW), strict=True)),
            }
        }
    ),
    "values with their names": "P1: X 405.8, Y -62.9, Z 251.6, U 40, V 12, W -172\n",
    "where": '{"schema": "robolink/where/1", "x_mm": 405.8, "y_mm": -62.9, "z_mm": 251.6, '
    '"u_deg": 40.0, "v_deg": 12.0, "w_deg": -172.0, "hand": null, "local": 0, "tool": null, '
    '"joints_deg": [1.0, 2.0, 3.0]}',
}


@each_row("form", FORMS)
def test_a_pose_is_read_as_its_maker_defines_it(read, form):
    (pose,) = read(FORMS[form]).poses
    assert pose.coordinates()[:3] == pytest.approx(PLACE, abs=1e-6)
    angles = (pose.u_deg, pose.v_deg, pose.w_deg)
    turned = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
    assert np.allclose(turned, TURNED.as_matrix(), atol=1e-7)


def test_names_tools_and_frames_are_kept_where_the_file_says_them(read):
    kuka = (
        f"DECL E6POS XPIN1={KUKA}\nDECL FDAT FPIN1={{TOOL_NO 3,BASE_NO 2,IPO_FRAME #BASE}}\n"
        "DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n"
    )
    found = read(kuka)
    (entry,) = found.entries
    assert (entry.name, entry.pose.tool, entry.pose.local) == ("XPIN1", 3, 2)
    assert found.how.skipped == 1
    first, second = read(FANUC.format(n=4, name="pin 1") + FANUC.format(n=5, name="")).entries
    assert (first.name, first.number, first.pose.tool, first.pose.local) == ("pin 1", 4, 3, 2)
    assert (second.name, second.number, second.line) == ("", 5, 7)
    first, second = read("P901 = XY(1, 2, 3, 4) /L /2 ' c\npin = XY(5, 6, 7, 8)\n").entries
    assert (first.number, first.pose.hand, first.pose.local) == (901, Hand.LEFT, 2)
    assert (second.name, second.pose.hand, "local" in second.stated) == ("pin", None, False)
    blocks = (
        "Pin 1:\n" + "\n".join([*ROWS, "0 0 0 1"]) + "\nPin 2:\n" + "\n".join([*ROWS, "0 0 0 1"])
    )
    assert [entry.name for entry in read(blocks).entries] == ["Pin 1", "Pin 2"]
    where = FORMS["where"].replace('"tool": null', '"tool": 2').replace("null", '"left"')
    (pose,) = read(f"[{where}]").poses
    assert (pose.tool, pose.hand, pose.local) == (2, Hand.LEFT, 0)


def test_answers_that_were_appended_to_a_file_are_read_one_after_the_other(read):
    assert len(read(FORMS["where"] + "\n" + FORMS["where"].replace(" ", "\n")).poses) == 2


@pytest.mark.fault("F39")
def test_units_that_a_format_defines_are_not_believed_against_reason(read):
    with pytest.raises(AmbiguousPosesError, match="too large") as caught:
        read("p[405.8, -62.9, 251.6, 0, 0, 0]\n")
    assert caught.value.asks == ("length",)
    (pose,) = read("p[405.8, -62.9, 251.6, 0, 0, 0]\n", length="mm").poses
    assert pose.coordinates()[:3] == PLACE


REFUSED = {
    "DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n": "joint angles are not a pose",
    "CONST jointtarget j1:=[[0,0,0,0,30,0],[9E+09,9E+09]];\n": "joint angles are not a pose",
    "movej([0,-1.57,1.57,0,0,0], a=1.4)\n": "joint angles are not a pose",
    "P[1]{\n GP1:\n UF : 0, UT : 1,\n J1= 0.0 deg, J2= 1.0 deg\n};\n": "are not a pose",
    "P1 = AglToPls(0, 0, 0, 0)\n": "not given in coordinates",
    "P1 = XY(300, 200, -50, 100) +X(10)\n": "line 1: the point is changed after its numbers",
    "P1 = XY(300, 200, -50)\n": "line 1: the point does not hold four or six",
    "P1 = XY(x, y, z, u)\n": "line 1: the point does not hold four or six",
    "DECL POS XP={X 1,Y 2,Z 3}\n": "line 1: there is no A, B, C",
    "p[1, 2, 3]\n": "line 1: p[..] does not hold six numbers",
    "p[0.1, 0.2, 0.3, 180, 0, 0]\n": "line 1: a rotation vector is longer",
    "CONST robtarget p:=[[1,2,3],[1,1,0,0],[0,0,0,0],[9E9,9E9]];": "line 1: the quaternion has",
    "name: [a, b]\nposition: [0.1, 0.2]\nvelocity: []\nx:\n": "no pose in it",
    f"pose:\n{indented(ROS, '  ')}   w: 3\n": "",
    '{"matrix": [[1,0,0,5],[0,1,0,6],[0,0,-1,7],[0,0,0,1]]}': "pose 1: the matrix is left-handed",
}


@each_row("text", REFUSED)
def test_what_is_no_pose_of_its_maker_is_refused(read, text):
    with pytest.raises(ConfigError) as caught:
        read(text)
    assert REFUSED[text] in caught.value.what


def test_four_rows_of_four_numbers_are_a_table_unless_they_are_rotations(read):
    rows = "287.5 103.25 -50 0\n296.75 87.5 -50 90\n312.5 96.75 -50 180\n293.4 111.1 -50 -45\n"
    with pytest.raises(AmbiguousPosesError):
        read(rows)
    assert len(read(rows, columns="x,y,z,u").poses) == 4


def test_a_target_to_which_another_tool_is_moved_is_no_place_of_the_flange(read):
    constant = f"CONST robtarget p1:={TARGET};\n"
    for text in (
        f"MoveL {TARGET},v100,fine,tNeedle;\n",
        f"MoveL {TARGET},v100,fine,tNeedle\\WObj:=wobj0;\n",
        f"{constant}MoveJ p1, v100, z10, tNeedle;\n",
    ):
        with pytest.raises(ConfigError, match="of the tool tNeedle, not of the flange"):
            read(text)
    assert len(read(f"{constant}MoveJ pOther, v100, z10, tNeedle;\n").poses) == 1
    assert len(read(f"{constant}MoveJ p1, v100, z10, tool0\\WObj:=wobj0;\n").poses) == 1


@pytest.mark.parametrize("line", ["X=1 Y=2 Z=ab U=4", "X=1 Y=2 U=4 Z=ab"])
def test_a_value_that_is_no_number_is_named_and_not_its_neighbour(read, line):
    with pytest.raises(ConfigError, match="Z is 'ab', which is no number"):
        read(f"{line}\n")


def test_no_point_of_a_list_is_passed_over(read):
    points = "P1 = XY(1, 2, 3, 4) /R /0\n{} = XY(11, 12, 13, 14) /R /0\n"
    labelled = read(points.format("P2(pin1)"))
    assert [entry.name for entry in labelled.entries] == ["", "pin1"]
    assert labelled.poses[1].x_mm == 11.0
    for unreadable in ("P2[pin1]", "P2 pin 1", "P2(pin 1)"):
        with pytest.raises(ConfigError, match="line 2"):
            read(points.format(unreadable))


@pytest.mark.parametrize("columns", ["rx ry rz", "rz ry rx"])
def test_columns_that_name_their_axes_are_not_counted(read, columns):
    angles = dict(zip(("rz", "ry", "rx"), ANGLES, strict=True))
    row = " ".join(str(angles[name]) for name in columns.split())
    (pose,) = read(f"x y z {columns}\n405.8 -62.9 251.6 {row}\n", euler="RzRyRx").poses
    assert pose.coordinates()[3:] == pytest.approx(ANGLES)


MELFA = "P1=(+405.80,-62.90,+251.60,-172.00,+12.00,+40.00)(7,0)\n"
SPELLED = {
    "MELFA BASIC": (MELFA, {}),
    "MELFA BASIC with steps and axes": (
        "10 P1=(405.8,-62.9,251.6,-172,12,40,0,0)(7,0) ' the pin\n20 J1=(0,1,2,3,4,5)\n",
        {},
    ),
    "numpy": (
        "[[ 4.05800000e+02 -6.29000000e+01  2.51600000e+02  4.00000000e+01\n"
        "   1.20000000e+01 -1.72000000e+02]]\n",
        {"columns": "x,y,z,u,v,w"},
    ),
    "numpy with commas": (
        "poses = np.array([[405.8, -62.9, 251.6,\n         40., 12., -172.]], dtype=float64)\n",
        {"columns": "x,y,z,u,v,w"},
    ),
    "numpy, a matrix": (
        "array([["
        + "],\n       [".join(", ".join(row.split()) for row in [*ROWS, "0 0 0 1"])
        + "]])",
        {},
    ),
    "a pose in a column": ("X;405,8\nY;-62,9\nZ;251,6\nU;40\nV;12\nW;-172\n", {}),
    "a pose in a column, with units": (
        "component,unit,P1\nX,mm,405.8\nY,mm,-62.9\nZ,mm,251.6\nA,deg,40\nB,deg,12\nC,deg,-172\n",
        {"euler": "kuka"},
    ),
    "KUKA, a sign for a blank": ("XP={X+405.8,Y-62.9,Z+251.6,A+40.0,B 12.0,C-172.0}\n", {}),
}


@each_row("form", SPELLED)
def test_a_pose_is_read_as_it_is_printed(read, form):
    text, choices = SPELLED[form]
    (pose,) = read(text, **choices).poses
    assert pose.coordinates()[:3] == pytest.approx(PLACE, abs=1e-6)
    turned = Rotation.from_euler("ZYX", (pose.u_deg, pose.v_deg, pose.w_deg), degrees=True)
    assert np.allclose(turned.as_matrix(), TURNED.as_matrix(), atol=1e-7)


def test_poses_in_columns_have_their_names(read):
    text = "\n".join(["name   P1  P2", "X  287.5 296.75", "Y  103.25 87.5", "U 0 90"])
    for first in ("name   P1  P2", "       P1  P2"):
        found = read(text.replace("name   P1  P2", first))
        assert [entry.name for entry in found.entries] == ["P1", "P2"]
        assert [pose.x_mm for pose in found.poses] == [287.5, 296.75]
        assert [pose.u_deg for pose in found.poses] == [0.0, 90.0]


ASKED_OR_REFUSED = {
    "a print with rows left out": (
        "[[287.5 103.25 -50. 0.]\n ...\n [296.75 87.5 -50. 90.]]\n",
        "line 2: it was printed with '...'",
    ),
    "a print without columns": ("[[287.5 103.25 -50. 0.]]\n", "names its 4 columns"),
    "commas in a part of a print": (
        "[[287.5, 103.25, -50. 0.],\n [296.75, 87.5, -50., 90.]]\n",
        "line 1: some numbers have a comma",
    ),
    "a row of a column is short": (
        "X;287,5;296,75\nY;103,25\nZ;-50;-50\nU;0;90\n",
        "line 2: it holds 1 values, X 2",
    ),
    "a component of a column is misspelt": (
        "X;287,5;296,75\nY;103,25;87,5\nZz;-50;-50\nU;0;90\n",
        "line 3: Zz is not the name of a component",
    ),
    "MELFA without flags": ("P1=(405.8,-62.9,251.6,-172,12,40)\n", "line 1: it is not a position"),
    "MELFA with a component left out": (
        "P1=(405.8,-62.9,251.6,,12,40)(7,0)\n",
        "line 1: there is no A",
    ),
    "MELFA with a comma": (
        MELFA + MELFA.replace("P1", "P2").replace("12.00", "12,00"),
        "line 2: a position holds six numbers, or eight, and this one 7",
    ),
    "a calculated pose of KUKA": (
        "XP2=XP1:{X 0.0,Y 0.0,Z 10.0,A 0.0,B 0.0,C 0.0}\n",
        "line 1: what stands beside the pose",
    ),
    "thousands without decimals": (
        "X;Y;Z;U\n1.131;103,25;-50,0;90\n287,5;1.003,25;-50,0;0\n",
        "line 2: X is '1.131'",
    ),
    "a pose twice": (f"DECL POS XP={KUKA}\nDECL POS XP={KUKA}\n", "line 2: XP appears twice"),
    "stars": (
        FANUC.format(n=1, name="") + FANUC.format(n=2, name="").replace("405.800", "*" * 7),
        "line 7: X is '*******': a number that did not fit",
    ),
    "a key twice": ('[{"x_mm": 1, "x_mm": 2, "y_mm": 20, "u_deg": 3}]', "x_mm appears twice"),
    "an angle of another magnitude": (
        f"DECL POS XP={KUKA.replace('40.0', '40000')}\n",
        "line 1: an angle of 40000 degrees",
    ),
    "a point that was lost": (
        "x,y,u\n287500,103.25,0\n297.5,104.25,90\n",
        "line 2: a place is 288 m",
    ),
    "a digit typed with shift": (
        "x y z u\n287.5 103.25 -50 0\n!87.5 103.25 -50 90\n",
        "line 3: it begins with !",
    ),
}


@each_row("case", ASKED_OR_REFUSED)
def test_what_is_not_whole_is_refused_by_its_line(read, case):
    text, why = ASKED_OR_REFUSED[case]
    with pytest.raises((ConfigError, CalibrationError)) as caught:
        read(text)
    assert why in caught.value.what


@pytest.mark.parametrize(
    "text",
    [
        "X;Y;Z;U\n1.131,9;103,25;-50,0;90\n287,5;1.003,25;-50,0;0\n",
        'X,Y,Z,U\n"1,131.9",103.25,-50.0,90\n287.5,"1,003.25",-50.0,0\n',
        "X\tY\tZ\tU\n1,131.9\t103.25\t-50.0\t90\n287.5\t1,003.25\t-50.0\t0\n",
    ],
)
def test_thousands_are_grouped_where_the_decimal_sign_follows(read, text):
    first, second = read(text).poses
    assert (first.x_mm, first.y_mm) == (1131.9, 103.25)
    assert (second.x_mm, second.y_mm) == (287.5, 1003.25)


COMMENTED = {
    "KUKA": (f"DECL POS XA={KUKA}\n{{}}DECL POS XB={KUKA}\n", ";"),
    "ABB": (f"CONST robtarget a:={TARGET};\n{{}}CONST robtarget b:={TARGET};\n", "!"),
    "URScript": (
        f"a=p[{', '.join([*METRES, *VECTOR])}]\n{{}}b=p[{', '.join([*METRES, *VECTOR])}]\n",
        "#",
    ),
    "SPEL+": ("P1 = XY(1, 2, 3, 4)\n{}P2 = XY(11, 12, 13, 14)\n", "'"),
    "MELFA": (MELFA + "{}" + MELFA.replace("P1", "P2"), "'"),
}


@each_row("maker", COMMENTED)
def test_a_pose_in_a_comment_is_counted_and_one_behind_a_sign_alone_refused(read, maker):
    text, sign = COMMENTED[maker]
    before, _, behind = text.partition("{}")
    assert len(read(before + behind).poses) == 2
    found = read(f"{before}{sign} {behind}")
    assert (len(found.poses), found.how.skipped) == (1, 1)
    with pytest.raises(ConfigError, match="line 2: it begins with"):
        read(f"{before}{sign}{behind}")


def test_rows_left_out_on_purpose_are_counted(read):
    found = read("x,y,u\n287.5,103.25,0\n# 296.75,87.5,90\n312.5,96.75,180\n")
    assert (len(found.poses), found.how.skipped) == (2, 1)


@pytest.mark.parametrize("row", ["0.29675,0.0875,-0.05,90", "296750,87500,-50000,90"])
def test_a_pose_in_another_unit_than_the_others_is_refused(read, row):
    text = f"x,y,z,u\n287.5,103.25,-50,0\n{row}\n312.5,96.75,-50,180\n"
    with pytest.raises(ConfigError, match="line 3"):
        read(text)
    assert len(read(text.replace(row, "0.5,87.5,-50,90")).poses) == 3
