"""Every hint of the pose reader is right: with the printed options, the file is accepted."""

import json
import re
from itertools import pairwise

import pytest
from robolink_cli import main

QUATERNION = "0.029526803,-0.934762234,-0.332466138,0.121712777"
"""The scalar first."""

FILES = {
    "no header, three columns": "287.5,103.25,0\n296.75,87.5,90\n",
    "no header, four": "287.5 103.25 -50 0\n296.75 87.5 -50 90\n",
    "no header, names in front": "P1;287,5;103,25;-50;0\nP2;296,75;87,5;-50;90\n",
    "no header, a remark behind": "287.5;103.25;-50;0;good\n296.75;87.5;-50;90;bad\n",
    "no header, six": "405.8 -62.9 251.6 0 0 180\n444.2 -60.4 247.3 40 12 -172\n",
    "no header, seven": f"405.8,-62.9,251.6,{QUATERNION}\n444.2,-60.4,247.3,{QUATERNION}\n",
    "no header, seven that are no quaternion": "405.8 -62.9 251.6 0 0 180 7\n1 20 3 4 5 6 70\n",
    "no header, five numbers": "287.5 103.25 -50 0 0.02\n296.75 87.5 -50 90 0.03\n",
    "no header, nine": "405.8 -62.9 251.6 0 0 180 7 8 9\n444.2 -60.4 247.3 40 12 -172 7 8 9\n",
    "printed by numpy": "[[287.5 103.25 -50. 0.]\n [296.75 87.5 -50. 90.]]\n",
    "rows of JSON": "[[287.5, 103.25, -50, 0], [296.75, 87.5, -50, 90]]",
    "radians or degrees": "x,y,z,u\n287.5,103.25,-50,0\n296.75,87.5,-50,1.5707963\n",
    "radians or degrees, another order": "u;name;z;y;x\n0;a;-50;103,25;287,5\n"
    "1,57;b;-50;87,5;296\n",
    "radians or degrees, with units": "name,X [mm],Y [mm],U,Remark\na,287.5,103.25,0,x\n"
    "b,296.75,87.5,3.14,y\n",
    "radians or degrees, three": "z,y,x,w,v,u\n251.6,-62.9,405.8,3.1,0,0\n"
    "247.3,-60.4,444.2,-3,0,1\n",
    "radians or degrees in JSON": '[{"u": 0, "y": 103.25, "x": 287.5}, '
    '{"u": 1.57, "y": 87.5, "x": 29}]',
    "radians or degrees beside names": "P1: X: 287.5 Y: 103.25 U: 0\n"
    "P2: X: 296.75 Y: 87.5 U: 1.57\n",
    "radians or degrees in columns": "X 287.5 296.75\nY 103.25 87.5\nU 0 1.57\n",
    "radians in a comment": "# radians\nx,y,z,u\n287.5,103.25,-50,0\n296.75,87.5,-50,90\n",
    "a column that might be a tilt": "x,y,z,u,theta\n287.5,103.25,-50,0,15\n"
    "296.75,87.5,-50,90,-1\n",
    "four numbers without a name": f"x,y,z,q1,q2,q3,q4\n405.8,-62.9,251.6,{QUATERNION}\n",
    "two rotations": f"x,y,z,u,qw,qx,qy,qz\n405.8,-62.9,251.6,40,{QUATERNION}\n",
    "V without W": "x,y,z,u,v\n287.5,103.25,-50,0,0\n296.75,87.5,-50,90,0\n",
    "Z is missing and a column unknown": "x,y,height,u\n287.5,103.25,-50,0\n296.75,87.5,-51,90\n",
    "A B C": "x,y,z,a,b,c\n405.8,-62.9,251.6,40,12,-172\n",
    "R P W in metres": "x,y,z,r,p,w\n0.4058,-0.0629,0.2516,-172,12,40\n",
    "a vector": "x,y,z,rx,ry,rz\n405.8,-62.9,251.6,-2.88,-1.03,0.38\n",
    "a vector or degrees": "x,y,z,rx,ry,rz\n405.8,-62.9,251.6,180,0,0\n",
    "metres or mm": "x,y,z,u\n0.2875,0.10325,-0.05,90\n0.29,0.11,-0.05,10\n",
    "inches in a comment": "# all in inches\nx,y,z,u\n11.3,4.06,-1.97,90\n",
    "a script in mm": "p[405.8, -62.9, 251.6, 0, 0, 0]\n",
}


@pytest.fixture
def shown(tmp_path, capsys):
    path = tmp_path / "poses.txt"

    def show(text, words):
        path.write_text(text, encoding="utf-8")
        code = main.run(["poses", "show", str(path), *words, "--json"])
        return code, json.loads(capsys.readouterr().out)

    return show


def hints_in(error):
    """Return the options that an error names, as typed, in the order of its findings.

    The readings stand below what is open, or behind the option.
    """
    found = []
    findings = re.findall(r"\n    \S.*((?:\n      .*)*)", error["what"])
    sentences = re.findall(r"(--\w+)(?:: (.*?))?(?:[.;]|$)", error["remedy"])
    for readings, (option, behind) in zip(findings, sentences, strict=True):
        found += [(option, one.strip().split(":")[0]) for one in readings.splitlines() if one]
        found += [(option, one) for one in re.findall(r"\w+", behind) if one != "or"]
    return found


def _without(words, option):
    """Return the words without an option and its value: a later answer replaces an earlier one."""
    at = words.index(option) if option in words else len(words)
    return (*words[:at], *words[at + 2 :])


@pytest.mark.parametrize("name", FILES)
def test_each_hint_is_accepted_as_it_stands(shown, name):
    text, followed, tried = FILES[name], 0, [()]
    while tried:
        words = tried.pop()
        code, answer = shown(text, words)
        if code == 0:
            followed += 1
            assert answer["poses"]
            continue
        error = answer["error"]
        assert (code, error["kind"]) == (2, "AmbiguousPosesError"), (words, error)
        hints = [(o, v) for o, v in hints_in(error) if (o, v) not in pairwise(words)]
        assert hints, (words, error)
        by_option: dict[str, list[str]] = {}
        for option, value in hints:
            by_option.setdefault(option, []).append(value)
        option = next(iter(by_option))
        rest = _without(words, option)
        tried += [(*rest, option, value) for value in by_option[option]]
    assert followed >= 1


JOINTS = {
    "a header": "J1 [deg],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg]\n0,-90,90,0,45,0\n",
    "a header of words": "base,shoulder,elbow,wrist1,wrist2,wrist3\n0,-1.57,1.57,0,0,0\n",
    "values with names": "J1: 0.0 J2: -90.0 J3: 90.0 J4: 0 J5: 45 J6: 0\n",
    "one a line": "J1 = 0.0\nJ2 = -90.0\nJ3 = 90.0\nJ4 = 0.0\n",
    "a message": "name: [shoulder_pan_joint, elbow_joint]\nposition: [0.1, -1.2]\nvelocity: []\n",
    "JSON": '[{"j1": 0, "j2": -90, "j3": 90, "j4": 0}]',
    "a script": "movej([0,-1.57,1.57,0,0,0], a=1.4)\n",
    "a program": "DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n",
    "MELFA": "J1=(+0.00,+10.00,+90.00,+0.00,+80.00,+0.00)\n",
}


@pytest.mark.parametrize("name", JOINTS)
def test_joint_values_are_called_joints_and_no_columns_are_offered(shown, name):
    code, answer = shown(JOINTS[name], ())
    error = answer["error"]
    assert (code, error["kind"]) == (2, "ConfigError")
    assert "joint angles are not a pose" in error["what"]
    assert "x,y,z" not in error["remedy"]
