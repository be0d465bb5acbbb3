"""A single slip in a file of poses is harmless, refused with its line, or asked about.

The sample runs by default; all slips, in the shared tables too, with 'make soak'.
"""

import json
import random
import re
from pathlib import Path

import pytest

from robolink.pose_tables import ReadingChoices
from robolink.pose_tables.encoding import decoded
from tests._rows import each_row
from tests.unit.pose_seeds import SEEDS
from tests.unit.pose_slips import outcome, read_as, slips_of

SHARED = Path(__file__).parents[2].parent / "shared" / "data" / "pose_tables"
LIST = SHARED / "expected.json"
TABLES = json.loads(LIST.read_text(encoding="utf-8"))["files"] if LIST.is_file() else {}
SAMPLE = 12
"""Slips of each file in the default run."""

PLACED = ("line ", "pose ")


def judged(folder, name, text, options, slips):
    """Return the slips that silently changed poses, and refusals without a place."""
    choices = ReadingChoices(**options)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    wanted = read_as(path, choices)
    silent, unplaced, counted = [], [], {"same": 0, "refused": 0, "asked": 0, "silent": 0}
    for slip in slips:
        path.write_text(slip.text, encoding="utf-8")
        what, said = outcome(path, choices, wanted)
        counted[what] += 1
        if what == "silent":
            silent.append((slip.kind, slip.line, slip.text.split("\n")[slip.line - 1], said))
        elif what == "refused" and not any(word in said for word in PLACED):
            unplaced.append((slip.kind, slip.line, said))
    return silent, unplaced, counted


@each_row("name", SEEDS)
def test_a_slip_changes_no_pose_in_silence(tmp_path, name):
    text, options = SEEDS[name]
    slips = random.Random(name).sample(list(slips_of(text)), SAMPLE)
    silent, _, counted = judged(tmp_path, name, text, options, slips)
    assert silent == []
    assert counted["refused"] > 0


@pytest.mark.soak
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", SEEDS)
def test_no_slip_changes_a_pose_in_silence(tmp_path, name):
    text, options = SEEDS[name]
    slips = list(slips_of(text))
    silent, unplaced, counted = judged(tmp_path, name, text, options, slips)
    assert silent == []
    assert len(unplaced) <= 0.1 * counted["refused"], unplaced[:5]


@pytest.mark.soak
@pytest.mark.timeout(600)
@pytest.mark.skipif(not TABLES, reason="the tables lie beside the repository and are not there")
@pytest.mark.parametrize("name", TABLES or ["absent"])
def test_no_slip_changes_a_pose_of_a_table_of_people_in_silence(tmp_path, name):
    text, _ = decoded((SHARED / name).read_bytes())
    slips = list(slips_of(text))
    silent, unplaced, counted = judged(tmp_path, name, text, TABLES[name]["options"], slips)
    assert silent == []
    assert len(unplaced) <= 0.1 * counted["refused"], unplaced[:5]


@pytest.mark.soak
@pytest.mark.timeout(60)
@pytest.mark.parametrize("name", ["kuka.dat", "fanuc.ls", "ur.script", "melfa.prg", "spel.txt"])
def test_a_long_program_is_read_in_seconds(tmp_path, name):
    text, options = SEEDS[name]
    begin = text[: text.index("\n") + 1] if name in ("kuka.dat", "ur.script") else ""
    record = text[len(begin) :].removesuffix("ENDDAT\n").removesuffix("end\n")
    numbered = re.compile(r"(?<!G)P[123]\b|P\[[123]\]|pin[123]\b")
    # Points have their own number.
    copies = [numbered.sub(_renumbered(at), record) for at in range(2000)]
    path = tmp_path / name
    path.write_text(begin + "".join(copies), encoding="utf-8")
    assert len(read_as(path, ReadingChoices(**options))) == 6000


def _renumbered(at):
    def renumbered(found):
        return re.sub(r"[123]", lambda digit: str(10 * at + int(digit[0])), found[0])

    return renumbered


FIELD = {
    "a comma in a program of KUKA": (
        "comma.dat",
        "XP1={X 287,735,Y 104,612,Z 50,000,A 0,000,B 0,000,C 0,000}\n",
        "line 1: '735' has no name: write decimals with a point, not a comma",
    ),
    "a comma in a program of FANUC": (
        "comma.ls",
        "P[1]{\n   GP1:\n\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        "\tX =   287,735  mm,\tY =   104,612  mm,\tZ =    50,000  mm,\n"
        "\tW =     0,000 deg,\tP =     0,000 deg,\tR =     0,000 deg\n};\n",
        "line 4: '735 mm' has no name: write decimals with a point, not a comma",
    ),
}


@pytest.mark.parametrize("case", FIELD)
def test_a_decimal_comma_in_a_program_is_refused_by_name(tmp_path, case):
    from robolink.errors import ConfigError

    name, text, why = FIELD[case]
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_as(path, ReadingChoices())
    assert why in caught.value.what


def test_a_sign_separates_a_name_from_its_number(tmp_path):
    path = tmp_path / "poses.txt"
    path.write_text(
        "XP1={X 287.735,Y 104.612,Z 50.0,A 0.0,B 0.0,C 0.0}\n"
        "XP2={X-304.612,Y 112.265,Z 50.0,A -90.0,B 0.0,C 0.0}\n",
        encoding="utf-8",
    )
    first, second = read_as(path, ReadingChoices())
    assert (first[0], second[0]) == (287.735, -304.612)
