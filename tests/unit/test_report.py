"""The report: a self-contained page, and its pictures."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree.ElementTree import tostring

import numpy as np
import pytest

from robolink import messages
from robolink.calibration import (
    Drift,
    Robust,
    Touch,
    VerifyResult,
    impact_on,
    solve_n_angle,
    solve_two_pose,
    solve_z_touch,
)
from robolink.errors import ConfigError
from robolink.files.named import require_free
from robolink.locale.languages import speak
from robolink.model import ControllerFacts, Hand, Pose, Signature, ToolOffset
from robolink.report import Outcome, Record, Report, render, save
from robolink.report.pictures.drawing import dot_names, step_down, step_up
from robolink.report.pictures.looks import LookCircle, LookPicture, look_markup
from robolink.report.pictures.plans import pose_drawings, tip_drawings
from robolink.report.pictures.residuals import fit_drawings, interval_ellipse, order_drawings
from tests._rows import each_row

# The report as a page: well formed, escaped, self-contained, and equal to its numbers.

OLD = ToolOffset(12.0, -3.5, -20.0)
NEW = ToolOffset(12.3, -3.9, -20.0)
NASTY = "<script>alert('1')</script>&\"\u202egnp.\x00\ud800 " + "x" * 200

POINTS: dict[int, Pose | None] = {
    number: Pose(200.0 + 22 * (number % 10), 30.0 * (number // 10), -30, 37 * number)
    for number in range(1, 51)
}

VOID = {"meta"}


def report(points=None, *, new=NEW, **more):
    impact = None if points is None else impact_on(points, old=OLD, new=new)
    known = {
        "made_at": "2026-03-04T10:11:12+00:00",
        "robolink_version": "1.2.3",
        "controller": "epson+tcp://192.168.0.1:5000",
        "facts": ControllerFacts(robot_models=("T6-602S",), robot_serials=("S1",)),
        "tool": 1,
        "before": OLD,
        "after": new,
        "outcome": Outcome.VERIFIED,
        "source": "measured",
        "method": "two-pose",
        "determined": ("x_mm", "y_mm"),
        "poses": (Pose(287.5, 103.25, 0, 0, hand=Hand.RIGHT), Pose(312.5, 96.75, 0, 180)),
        "impact": impact,
    }
    return Report(**{**known, **more})


class Page(HTMLParser):
    """Reads a page strictly: every element is closed, in order."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str | None]] = []
        self.texts: list[str] = []
        self.values: list[float] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, *pair) for pair in attrs]
        if tag == "data":
            self.values.append(float(dict(attrs)["value"]))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.texts.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.texts).split())

    def under(self, tag, class_):
        return [a for a in self.attributes if a[0] == tag and a[1:] == ("class", class_)]


EVERY = {
    "50 points": report(POINTS),
    "one point": report({3: Pose(250, 200, -30, 90)}),
    "no shift": report(POINTS, new=OLD),
    "upwards only": report(POINTS, new=ToolOffset(12.0, -3.5, -19.0)),
    "a huge shift": report(POINTS, new=ToolOffset(900.0)),
    "all on one spot": report({number: Pose(1, 2, 3, 0) for number in range(1, 60)}),
    "none taught": report({1: None, 2: Pose(1, 2, 3, 4, local=5)}),
    "no points named": report(),
    "undefined before": report(before=None, outcome=Outcome.DECLINED),
    "hostile names": report(
        POINTS,
        controller=NASTY,
        facts=ControllerFacts(NASTY, NASTY, NASTY, NASTY, NASTY, 1, (NASTY,), (NASTY,)),
        source=NASTY,
        ending=NASTY,
        warnings=(NASTY,),
        outcome=Outcome.REFUSED,
    ),
}


@each_row("name", EVERY)
def test_a_page_is_well_formed_and_needs_nothing_beside_itself(name):
    text = render(EVERY[name])
    page = Page(text)
    assert text.startswith("<!DOCTYPE html>\n<html")
    assert page.tags.count("h1") == page.tags.count("body") == 1
    assert not {"script", "link", "img", "iframe", "object", "use", "image", "a"} & {*page.tags}
    loading = {"src", "href", "xlink:href", "style", "srcset", "action", "data"}
    assert [a for a in page.attributes if a[1] in loading or a[1].startswith("on")] == []
    assert not re.search(r"url\(|@import", text)
    assert "nan" not in {v for _, key, v in page.attributes if key != "content"}
    text.encode("utf-8")


def test_names_from_outside_are_text_and_their_invisible_characters_are_shown():
    text = render(EVERY["hostile names"])
    assert "<script" not in text
    assert not {"\u202e", "\x00", "\ud800"} & {*text}
    assert "<script>alert('1')</script>&\"\ufffdgnp.\ufffd\ufffd" in Page(text).text


def test_the_numbers_of_the_points_are_whole_and_shown_with_three_digits():
    made = EVERY["50 points"]
    page = Page(render(made))
    for entry in made.impact.entries:
        row = [*entry.pose.coordinates()[:4], entry.dx_mm, entry.dy_mm, entry.dz_mm]
        row += [entry.turn_deg, entry.distance_mm]
        at = next(i for i in range(len(page.values)) if page.values[i : i + len(row)] == row)
        assert at > 0
    assert "-0.000" not in page.text
    assert "X mm 12.000 12.300 0.300 Y mm -3.500 -3.900 -0.400" in page.text
    assert "Kept, not measured Z mm U deg V deg W deg before -20.000 0.000 0.000" in page.text


def test_the_largest_is_marked_once_in_the_table_and_once_in_the_picture():
    made = impact_on(POINTS, old=OLD, new=NEW)
    first, *others = made.entries
    least = [replace(one, dx_mm=one.dx_mm / 2, dy_mm=one.dy_mm / 2) for one in others]
    page = Page(render(report(impact=replace(made, entries=(first, *least)))))
    assert len(page.under("tr", "largest")) == len(page.under("g", "largest")) == 1
    assert page.text.count("P1, largest") == 1
    assert "P1: 0.500 mm" in page.text
    assert "Largest: 0.500 mm, P1." in page.text
    assert "The ring marks the largest." in page.text


def test_where_the_tip_moves_equally_far_at_every_point_none_is_called_the_largest():
    page = Page(render(EVERY["50 points"]))
    assert page.under("tr", "largest") == page.under("g", "largest") == []
    assert "largest" not in page.text.lower()
    assert "At every point: 0.500 mm. Only its direction turns with U." in page.text


@each_row("name", ["50 points", "one point", "a huge shift"])
def test_arrows_are_as_long_as_the_stated_factor_says_and_stay_on_the_paper(name):
    made = EVERY[name]
    text = render(made)
    (factor,) = re.findall(r"drawn ([0-9.e+-]+) times as long as it is", text)
    ((width, height),) = re.findall(r'<rect width="(\d+)" height="([\d.]+)"', text)
    per_mm = scale_of(text)
    shafts = re.findall(r'class="(?:point|largest)"><title>P(\d+).*?<polygon points="(.*?)"', text)
    dots = dict(re.findall(r'<title>P(\d+):.*?<circle cx="([^"]+" cy="[^"]+)" r="2.6"', text))
    assert len(shafts) == len(made.impact.entries)
    for number, corners in shafts:
        (entry,) = (e for e in made.impact.entries if e.number == int(number))
        tip_x, tip_y = map(float, corners.split()[0].split(","))
        x, y = map(float, dots[number].split('" cy="'))
        assert 0 <= tip_x <= float(width)
        assert 0 <= tip_y <= float(height)
        assert tip_x - x == pytest.approx(float(factor) * entry.dx_mm * per_mm, abs=0.02)
        assert y - tip_y == pytest.approx(float(factor) * entry.dy_mm * per_mm, abs=0.02)


def scale_of(text):
    """Return the paper units per mm, by the picture's ruler."""
    length = re.findall(r'class="bar" x1="0.00" y1="[^"]*" x2="([^"]*)"', text)[0]
    (millimetres,) = re.findall(r"points: ([\d.]+) mm", text)
    return float(length) / float(millimetres)


def test_every_point_of_an_ordinary_picture_has_its_number_and_no_two_overlap():
    boxes = [
        (float(x) - 2.6 * len(number), float(y) - 7, float(x) + 2.6 * len(number), float(y))
        for number, x, y in names_of(render(EVERY["50 points"]))
    ]
    assert len(boxes) == 50
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def names_of(text):
    found = re.findall(r'<text x="([^"]+)" y="([^"]+)" class="name"[^>]*>(\d+)<', text)
    return [(number, x, y) for x, y, number in found]


def test_numbers_without_room_are_left_out_and_counted():
    text = render(EVERY["all on one spot"])
    (count,) = re.findall(r"(\d+) numbers have no room", text)
    assert len(names_of(text)) + int(count) == 59
    assert "P1: 0.500 mm" in text


def test_without_a_shift_there_is_no_arrow_and_it_is_said():
    page = Page(render(EVERY["no shift"]))
    assert "polygon" not in page.tags
    assert "The tip stays where it is" in page.text
    upwards = Page(render(EVERY["upwards only"]))
    assert "polygon" not in upwards.tags
    assert "At every point: 1.000 mm." in upwards.text
    assert "only its direction turns" not in upwards.text
    assert "Nothing moves sideways" in upwards.text


def test_points_that_cannot_be_judged_are_counted_and_named():
    page = Page(render(EVERY["none taught"]))
    assert "No point could be judged." in page.text
    for words in ("Not taught, skipped: 1.", "P2 (local 5)"):
        assert words in page.text
    assert "svg" not in page.tags


OUTCOMES = {
    Outcome.VERIFIED: "Written, read back and tested",
    Outcome.WRITTEN: "Written and read back, not tested",
    Outcome.SKIPPED: "Stored already, nothing was written",
    Outcome.PROPOSED: "A proposal, nothing was written",
    Outcome.DECLINED: "Declined, nothing was written",
    Outcome.REFUSED: "Refused, nothing was written",
    Outcome.VERIFY_FAILED: "The turn test failed",
    Outcome.NOT_APPLIED: "Not applied, the tool keeps its old value",
    Outcome.ROLLED_BACK: "Undone, the tool has its old value again",
    Outcome.CONFLICT: "Conflict: the tool holds neither the old nor the new value",
    Outcome.UNFINISHED: "Not finished",
}


@each_row("outcome", Outcome)
def test_how_it_ended_stands_at_the_top(outcome):
    text = Page(render(report(outcome=outcome, ending="Because."))).text
    assert text.index(OUTCOMES[outcome]) < text.index("Because.") < text.index("controller epson")


def test_the_arrow_of_a_change_begins_where_the_tip_was():
    record = Record("C-1", Signature(), people=(), entries=(), check="")
    (drawing,) = tip_drawings(report(record=record))
    picture = tostring(drawing.svg, encoding="unicode")
    assert "from before (grey) to after: X +0.300 mm, Y -0.400 mm" in drawing.caption
    (before,) = re.findall(r'class="old"><circle cx="([^"]*)" cy="([^"]*)"', picture)
    assert before == ("125.00", "125.00")  # the middle
    (arrow,) = re.findall(r'class="shaft" x1="([^"]*)" y1="([^"]*)"', picture)
    assert arrow == before


def test_the_drifts_are_shown_with_what_is_allowed():
    drifts = (Drift(90, 0.3, -0.4), Drift(0, 0.01, 0.0))
    page = Page(render(report(verification=VerifyResult(drifts, 0.2))))
    assert "Failed: 0.500 mm off at most, limit 0.200 mm." in page.text
    assert "90.000 0.300 -0.400 0.500" in page.text


def test_a_page_names_its_language_and_keeps_its_figures_whole_in_it():
    drifts = (Drift(90, 0.1, 0.0), Drift(0, 0.01, 0.0))
    shown = report(verification=VerifyResult(drifts, 0.2))
    english = render(shown)
    speak("zh")
    try:
        chinese = render(shown)
    finally:
        messages.install(None)
    for page, language, verdict in (
        (english, "en", "Passed: "),
        (chinese, "zh-CN", "\u901a\u8fc7\uff1a"),
    ):
        assert f'<html lang="{language}">' in page
        assert verdict in page
        assert '<data value="0.1">0.100</data> mm' in page


def test_a_file_is_written_over_only_when_told(tmp_path):
    path = tmp_path / "page.html"
    require_free(path)
    save(report(), path)
    first = path.read_bytes()
    with pytest.raises(ConfigError, match="exists already"):
        require_free(path)
    with pytest.raises(ConfigError, match="exists already"):
        save(report(POINTS), path)
    assert path.read_bytes() == first
    require_free(path, replace=True)
    save(report(POINTS), path, replace=True)
    assert path.read_bytes() != first


def test_a_folder_that_is_missing_is_found_before_anything_is_asked(tmp_path):
    with pytest.raises(ConfigError, match="cannot be written"):
        require_free(tmp_path / "missing" / "page.html")
    with pytest.raises(ConfigError, match="cannot be written"):
        save(report(), tmp_path / "missing" / "page.html")


# The picture of a measurement: residuals, the interval as an ellipse, the poses from above.

TIP = ToolOffset(12.0, -3.5, -20.0)
ERRORS = ((0.012, -0.004), (-0.009, 0.011), (0.003, 0.007), (-0.006, -0.010), (0.004, 0.002))


def touches(*angles_deg, errors=ERRORS):
    poses = []
    for angle, (dx, dy) in zip(angles_deg, errors, strict=False):
        a = math.radians(angle)
        x = 200 + dx - math.cos(a) * TIP.x_mm + math.sin(a) * TIP.y_mm
        y = 300 + dy - math.sin(a) * TIP.x_mm - math.cos(a) * TIP.y_mm
        poses.append(Pose(x, y, -80.0, angle))
    return poses


def report_of_fit(result):
    return Report(
        made_at="2026-03-04T10:11:12+00:00",
        robolink_version="1.2.3",
        controller="epson+tcp://192.168.0.1:5000",
        facts=ControllerFacts(),
        tool=1,
        before=TIP,
        after=result.offset,
        outcome=Outcome.PROPOSED,
        method=result.method,
        determined=result.measured,
        poses=result.inputs,
        fit=result,
    )


def drawn(parts):
    return "".join(tostring(part.svg, encoding="unicode") + part.caption for part in parts)


@pytest.mark.parametrize("angles", [(0, 20, 45, 60, 90), (0, 72, 144, 216, 288)])
def test_the_ellipse_reaches_as_far_as_the_intervals_of_x_and_y(angles):
    result = solve_n_angle(touches(*angles))
    axes = interval_ellipse(result)
    assert axes is not None
    long_mm, short_mm, turn_deg = axes
    assert long_mm >= short_mm > 0
    turn = math.radians(turn_deg)
    reach_x = math.hypot(long_mm * math.cos(turn), short_mm * math.sin(turn))
    reach_y = math.hypot(long_mm * math.sin(turn), short_mm * math.cos(turn))
    assert (reach_x, reach_y) == pytest.approx(result.half_width95[:2])
    values, vectors = np.linalg.eigh(np.array(result.covariance))
    assert short_mm / long_mm == pytest.approx(math.sqrt(values[0] / values[1]))
    if short_mm < 0.99 * long_mm:
        along = np.array([math.cos(turn), math.sin(turn)])
        assert abs(along @ vectors[:, 1]) == pytest.approx(1.0)


def test_two_touches_have_no_ellipse_and_the_page_says_why():
    result = solve_two_pose(*touches(0, 180))
    assert interval_ellipse(result) is None
    assert drawn(fit_drawings(result)) == ""
    assert "Repeatable: not known (two touches cannot check each other)." in render(
        report_of_fit(result)
    )


def test_a_pose_without_a_residual_has_its_number_and_the_plan_names_its_cross():
    result = solve_two_pose(*touches(0, 180))
    page = render(report_of_fit(result))
    assert "along X" not in page
    assert "second move" not in page
    assert "the cross the reference point" in drawn(pose_drawings(result))
    nowhere = replace(result, reference_point_mm=())
    assert "cross" not in drawn(pose_drawings(nowhere))


def test_three_residuals_have_an_order_and_two_have_none():
    result = solve_n_angle(touches(0, 120, 240))
    assert drawn(order_drawings(result, {}))
    fewer = replace(result, residuals_mm=result.residuals_mm[:2])
    assert not drawn(order_drawings(fewer, {}))


def test_a_stated_sigma_gives_two_touches_an_ellipse():
    result = solve_two_pose(*touches(0, 180), sigma_mm=0.02)
    assert "<ellipse" in drawn(fit_drawings(result))
    assert "stated standard deviation of 0.02 mm" in render(report_of_fit(result))


def test_each_pose_has_its_dot_its_row_and_its_place():
    result = solve_n_angle(touches(0, 72, 144, 216, 288))
    picture, page = drawn(fit_drawings(result)), render(report_of_fit(result))
    assert picture.count('class="point"') == len(ERRORS) + 1  # and the middle of the ellipse
    assert 'class="rms"' in picture
    for residual in result.residual_distances_mm:
        assert f'value="{residual!r}"' in page
    assert drawn(pose_drawings(result)).count("<polygon") == len(ERRORS)
    assert "degrees of freedom: 6" in page


def test_a_pose_that_was_left_out_is_marked_in_picture_table_and_plan():
    angles = (0, 60, 120, 180, 240, 300)
    errors = ((0.0, 0.0),) * 3 + ((1.5, 0.0),) + ((0.0, 0.001),) * 2
    result = solve_n_angle(touches(*angles, errors=errors), robust=Robust())
    assert result.rejected == (3,)
    picture, page = drawn(fit_drawings(result)), render(report_of_fit(result))
    assert picture.count('class="largest"') == 1
    assert "red: left out" in picture
    assert "4 (left out)" in page
    assert drawn(pose_drawings(result)).count('class="largest"') == 1


def test_heights_have_no_picture_from_above_and_need_none():
    touches = [Touch(-106.0 - 0.01 * v + e, v) for v, e in ((2.0, 0.002), (1.0, 0.0), (2.0, 0.0))]
    result = solve_z_touch(touches, -86.0, stored=TIP)
    assert result.residuals_mm
    assert drawn(fit_drawings(result)) == drawn(pose_drawings(result)) == ""
    assert "repeatable to, 95 %" in render(report_of_fit(result))


# Round numbers and names in the pictures of a report.


@each_row(("value", "down", "up"), [(37.0, 30.0, 50.0), (0.72, 0.6, 1.0), (170.0, 150.0, 200.0)])
def test_a_scale_is_a_round_number_beside_the_value(value, down, up):
    assert step_down(value) == pytest.approx(down)
    assert step_up(value) == pytest.approx(up)


def test_a_dot_has_its_name_where_there_is_room_and_none_elsewhere():
    places = [(100.0, 100.0), *[(200.0, 200.0)] * 20]
    names = [name.text for name in dot_names(places, [f"dot {n}" for n in range(21)])]
    assert names[:2] == ["dot 0", "dot 1"]
    assert len(names) < 21


def test_the_cross_of_a_small_circle_is_as_long_as_its_radius():
    circles = (LookCircle(40.0, 30.0, 2.0, accepted=True), LookCircle(10.0, 30.0, 2.0, False))
    shown = look_markup(LookPicture(b"", 800, 600, circles))
    assert re.findall(r' d="([^"]*)"', shown) == ["M39.0 30.0H41.0M40.0 29.0V31.0"]
