"""The share of tips within the stated accuracy, for the errors of real sensors.

Each line is a cell with an error that no residual shows, and which the cell states as a row of the
budget. ``repeatable`` is the share of truths within the statement of scatter alone, ``accurate``
within the one with all rows, ``understated`` the same with rows a fifth as wide.
docs/reference/evidence.md 19 has the figures of 2,000 runs a line (``make soak``).
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from robolink.calibration import (
    AccuracyFacts,
    CalibrationResult,
    CameraModel,
    PixelSighting,
    RowFact,
    Sighting,
    assessed,
    pin_touched,
    solve_board,
    solve_board_round,
    solve_camera_affine,
    solve_camera_round,
    solve_one_touch,
    solve_runout_table,
    solve_up_camera,
)
from robolink.model import Pose, ToolOffset, rotate_xy

TIP = complex(12.3, -3.9)
MIDDLE = complex(300.0, 80.0)
CAMERA = CameraModel(((0.02, 0.0), (0.0, 0.02)), (290.0, 70.0), centre_mm=(300.0, 80.0))
SIGMA_MM = 0.005
ROUGH_MM = 0.01
HALF_ROUND = (0.0, 60.0, 120.0, 180.0)
DRAWING = ((20.0, 12.5), (-20.0, 12.5), (-20.0, -12.5), (20.0, -12.5))
PRINT_MM = 0.01
BOARD_TURN_DEG = 1.2

Random = np.random.Generator
Measure = Callable[[Random], CalibrationResult]


@dataclass(frozen=True)
class Line:
    """A kind of error.

    Attributes:
        name: The error.
        measure: One calibration.
        rows: The rows that the cell states; all others are stated as zero.
        repeatable: The largest share of runs, in %, within the statement of scatter.
        least, most: The limits of the share, in %, within the one with all rows, in 2,000 runs.
    """

    name: str
    measure: Measure
    rows: dict[str, float]
    repeatable: float = 100.0
    least: float = 94.0
    most: float = 99.5

    def facts(self, share: float = 1.0) -> AccuracyFacts:
        """Return the facts that the cell states, or a share of them."""
        keys = (
            *("tip_image_px", "place_mm", "camera_turn_deg", "camera_scale_percent"),
            *("print_mm", "touch_mm"),
        )
        return AccuracyFacts(
            {key: RowFact(share * self.rows.get(key, 0.0), "stated") for key in keys}
        )


def anywhere(random: Random) -> complex:
    """Return a random direction."""
    return complex(np.exp(2j * math.pi * random.random()))


def within(random: Random, half_width: float) -> complex:
    """Return a vector with each coordinate uniform within a half width."""
    return complex(*random.uniform(-half_width, half_width, 2).tolist())


def seen(
    random: Random,
    angles_deg,
    *,
    aside: complex = 0.0,
    error: complex = 0.0,
    place: complex = 0.0,
    image: complex = 0.0,
    wobble=lambda z: 0.0,
    sigma_mm: float = SIGMA_MM,
) -> list[Sighting]:
    """Return looks at a tip.

    Args:
        random: Draws the scatter.
        angles_deg: U of each look.
        aside: How far beside the middle the tip is brought, in the axes of the tool.
        error: Relative error of the camera's scale, with its turn as imaginary part.
        place: The error of the camera's place.
        image: How far beside the tip it is seen, in the axes of the tool.
        wobble: The distance of the tip from its offset, by exp(iU).
        sigma_mm: Scatter of one coordinate.
    """
    looks = []
    for u_deg in angles_deg:
        z = complex(np.exp(1j * math.radians(u_deg)))
        true = MIDDLE + z * aside
        flange = true - z * TIP
        shown = true + wobble(z) + z * image
        shown += error * (shown - MIDDLE) + place + complex(*random.normal(0, sigma_mm, 2))
        looks.append(Sighting(Pose(flange.real, flange.imag, -60, u_deg), shown.real, shown.imag))
    return looks


def off_centre(angles_deg, error, *, sigma_mm=ROUGH_MM):
    """Look at the tip 0.8 mm beside the middle, with a camera that is wrong by ``error``."""

    def measure(random):
        aside = 0.8 * anywhere(random)
        looks = seen(random, angles_deg, aside=aside, error=error, sigma_mm=ROUGH_MM)
        return solve_camera_round(looks, sigma_mm=sigma_mm, camera=CAMERA)

    return measure


def somewhere(angles_deg, half_width):
    """The same, with a scale error drawn within a half width."""

    def measure(random):
        return off_centre(angles_deg, random.uniform(-half_width, half_width))(random)

    return measure


def all_at_once(angles_deg, rows):
    """Draw every row's error within its half width."""

    def measure(random):
        scale, turn = (
            random.uniform(-1, 1) * rows.get(key, 0.0) * unit
            for key, unit in (("camera_scale_percent", 0.01), ("camera_turn_deg", math.radians(1)))
        )
        looks = seen(
            random,
            angles_deg,
            aside=0.8 * anywhere(random),
            error=complex(scale, turn),
            place=within(random, rows.get("place_mm", 0.0)),
            image=within(random, 0.02 * rows["tip_image_px"]),
        )
        return solve_camera_round(looks, sigma_mm=SIGMA_MM, camera=CAMERA)

    return measure


def wobbling(angles_deg, term, *, image_px=0.0, jitter_deg=0.0):
    """Add a spindle harmonic of 0.06 mm."""

    def measure(random):
        amplitude = 0.06 * anywhere(random)
        angles = np.array(angles_deg) + random.uniform(-jitter_deg, jitter_deg, len(angles_deg))
        looks = seen(
            random,
            angles.tolist(),
            wobble=lambda z: amplitude * term(z),
            image=within(random, 0.02 * image_px),
        )
        return solve_runout_table(looks, camera=CAMERA)

    return measure


def printed(angles_deg, drawing=DRAWING, *, sigma_mm=None):
    """Shift fiducials up to 10 um from their drawing, and the camera by 0.05 mm."""

    def measure(random):
        aside = random.uniform(-PRINT_MM, PRINT_MM, (len(drawing), 2)).tolist()
        looks, drawn = [], []
        for u_deg in angles_deg:
            for (x, y), (dx, dy) in zip(drawing, aside, strict=True):
                place, true = (
                    TIP + complex(*rotate_xy(px, py, BOARD_TURN_DEG))
                    for px, py in ((x, y), (x + dx, y + dy))
                )
                (look,) = seen(random, (u_deg,), place=0.05)
                z = complex(np.exp(1j * math.radians(u_deg)))
                flange = MIDDLE - z * place
                shown = complex(look.x_mm, look.y_mm) + z * (true - place)
                pose = replace(look.flange, x_mm=flange.real, y_mm=flange.imag)
                looks.append(Sighting(pose, shown.real, shown.imag))
                drawn.append((x, y))
        return solve_board_round(looks, drawn, sigma_mm=sigma_mm, camera=CAMERA)

    return measure


def of_unknown_place(random, image_px=0.5):
    """Find a camera together with the tip, which it sees up to half a pixel off."""
    image = within(random, image_px)
    places = [(dx, dy, 0.0) for dx in (-3.0, 3.0) for dy in (-3.0, 3.0)]
    places += [(0.0, 0.0, u_deg) for u_deg in HALF_ROUND]
    sightings = []
    for dx, dy, u_deg in places:
        z = complex(np.exp(1j * math.radians(u_deg)))
        true = MIDDLE + complex(dx, dy)
        flange = true - z * TIP
        pixel = (true - complex(290.0, 70.0)) / 0.02 + z * image
        pixel += complex(*random.normal(0, SIGMA_MM / 0.02, 2))
        pose = Pose(flange.real, flange.imag, -60, u_deg)
        sightings.append(PixelSighting(pose, pixel.real, pixel.imag))
    return solve_camera_affine(sightings)


ROWS = {
    "tip_image_px": 0.5,
    "place_mm": 0.02,
    "camera_turn_deg": 0.5,
    "camera_scale_percent": 0.5,
}
ROUND = range(0, 360, 45)

LINES = [
    Line(
        "one look 0.8 mm off the middle, scale off by 2 % at most",
        somewhere((0.0,), 0.02),
        {"camera_scale_percent": 2.0},
        91.0,
    ),
    Line(
        "one look 0.8 mm off the middle, scale +2 %",
        off_centre((0.0,), 0.02),
        {"camera_scale_percent": 2.0},
        75.0,
    ),
    Line(
        "the same at 4 angles, sigma stated",
        off_centre(HALF_ROUND, 0.02),
        {"camera_scale_percent": 2.0},
        70.0,
    ),
    Line(
        "the same at 4 angles, sigma from residuals",
        off_centre(HALF_ROUND, 0.02, sigma_mm=None),
        {"camera_scale_percent": 2.0},
        70.0,
    ),
    Line(
        "4 angles 0.8 mm off the middle, camera turned by 1 degree",
        off_centre(HALF_ROUND, complex(0, math.radians(1))),
        {"camera_turn_deg": 1.0},
        75.0,
    ),
    Line("one look, all rows at random", all_at_once((0.0,), ROWS), ROWS, 80.0),
    Line("four angles, all rows at random", all_at_once(HALF_ROUND, ROWS), ROWS, 90.0),
    Line("camera found with the tip", of_unknown_place, {"tip_image_px": 0.5}, 94.0),
    *(
        Line(f"fiducials printed to 10 um, {name}", measure, {"print_mm": PRINT_MM}, most_told)
        for name, measure, most_told in (
            ("4 at 2 angles", printed((0.0, 120.0)), 91.0),
            ("4 at 2 angles, sigma stated", printed((0.0, 120.0), sigma_mm=SIGMA_MM), 91.0),
            ("4 at 4 angles", printed(HALF_ROUND), 75.0),
            ("2 at 2 angles", printed((0.0, 120.0), DRAWING[:2]), 93.0),
        )
    ),
    *(
        Line(
            f"a harmonic of 0.06 mm, {name}",
            wobbling(angles, term, image_px=0.5, jitter_deg=jitter),
            {"tip_image_px": 0.5},
        )
        for name, angles, term, jitter in (
            ("ellipse, 8 looks", ROUND, np.conj, 0.0),
            ("second, 8 looks", ROUND, np.square, 0.0),
            ("second, 8 looks not quite evenly", ROUND, np.square, 7.0),
            ("second, 12 looks", range(0, 360, 30), np.square, 0.0),
        )
    ),
]
NAMES = [line.name for line in LINES]

HARMONICS = [
    (f"{name}, {count} looks", wobbling(range(0, 360, 360 // count), term))
    for name, term in (("ellipse", np.conj), ("second harmonic", np.square))
    for count in (8, 12)
]


@dataclass
class Shares:
    """Shares of runs in %, and the median of U in mm."""

    repeatable: float
    accurate: float
    understated: float
    median_mm: float


def error_mm(result: CalibrationResult) -> float:
    """Return the distance of the found tip from the true one."""
    return abs(complex(result.offset.x_mm, result.offset.y_mm) - TIP)


def run(line: Line, trials: int) -> Shares:
    """Return the shares for a kind of error."""
    random = np.random.default_rng(19)
    held, widths = np.zeros(3), []
    for _ in range(trials):
        result = assessed(line.measure(random), line.facts())
        less = assessed(result, line.facts(0.2))
        off_mm = error_mm(result)
        stated = (result.repeatable_to_mm, result.accurate_to_mm, less.accurate_to_mm)
        held += [off_mm <= (one or 0.0) for one in stated]
        widths.append(result.accurate_to_mm or 0.0)
    repeatable, accurate, understated = (100 * held / trials).tolist()
    return Shares(repeatable, accurate, understated, float(np.median(widths)))


SAMPLE = (
    "one look 0.8 mm off the middle, scale +2 %",
    "the same at 4 angles, sigma stated",
    "four angles, all rows at random",
    "fiducials printed to 10 um, 4 at 4 angles",
)


@pytest.mark.parametrize("name", SAMPLE)
def test_a_sample_of_the_table(name):
    line = LINES[NAMES.index(name)]
    shares = run(line, 40)
    assert shares.accurate > 82, shares
    assert shares.understated < shares.accurate - 10, shares
    assert shares.repeatable < line.repeatable + 15, shares


@pytest.mark.parametrize(("name", "measure"), HARMONICS[:1])
def test_a_wobble_leaves_the_region_as_it_is(name, measure):
    """The region holds both coordinates in 95 %; an interval an axis holds them in 87 to 91."""
    held = region_and_axis(measure, 200)
    assert held[0] > 88, (name, held)
    assert held[0] > held[1], (name, held)


def region_and_axis(measure, trials):
    """Return the shares of tips in the region, and within a radius like one axis's interval."""
    random = np.random.default_rng(23)
    held = np.zeros(2)
    for _ in range(trials):
        result = measure(random)
        off_mm = error_mm(result)
        held += (
            off_mm <= (result.repeatable_to_mm or 0.0),
            off_mm <= max(result.half_width95),
        )
    region, axis = (100 * held / trials).tolist()
    return region, axis


def test_a_single_look_or_touch_is_repeatable_to_a_region():
    """All lengths together: 2.448 sigma in the plane and 2.795 in space, not 1.96 for each axis."""
    flange, tip = Pose(300, 100, -60, 0), ToolOffset(12, -3.5, -20)
    seen = Sighting(flange, 312.3, 96.3)
    pair = Sighting(flange, 320.0, 96.0), Sighting(flange, 280.0, 96.0)
    pin = pin_touched(flange, tip)
    for result, factor in (
        (solve_up_camera(seen, sigma_mm=0.01), 2.448),
        (solve_up_camera(replace(seen, z_mm=-80.0), sigma_mm=0.01), 2.795),
        (solve_board(*pair, sigma_mm=0.01), 2.448 / math.sqrt(2)),
        (solve_one_touch(flange, pin, sigma_mm=0.01), 2.795),
    ):
        assert result.repeatable_to_mm == pytest.approx(0.01 * factor, rel=0.001)


def test_a_row_never_makes_a_result_better_than_its_scatter():
    """Few residuals have a wide factor, which a known row would otherwise reduce."""
    random = np.random.default_rng(29)
    line = LINES[NAMES.index("fiducials printed to 10 um, 2 at 2 angles")]
    for _ in range(12):
        result = assessed(line.measure(random), line.facts())
        assert (result.accurate_to_mm or 0.0) >= (result.repeatable_to_mm or 0.0)


@pytest.mark.soak
@pytest.mark.timeout(120)
@pytest.mark.parametrize("line", LINES, ids=NAMES)
def test_the_table_of_statements(line):
    shares = run(line, 2000)
    sys.stdout.write(
        f"| {line.name} | {shares.repeatable:.0f} | {shares.accurate:.1f} "
        f"| {shares.understated:.0f} | {shares.median_mm:.3f} |\n"
    )
    assert line.least <= shares.accurate <= line.most, shares
    assert shares.repeatable <= line.repeatable, shares
    assert shares.understated < shares.accurate - 3, shares


@pytest.mark.soak
@pytest.mark.timeout(120)
@pytest.mark.parametrize(("name", "measure"), HARMONICS, ids=[name for name, _ in HARMONICS])
def test_the_region_of_a_wobbling_tip(name, measure):
    region, axis = region_and_axis(measure, 2000)
    sys.stdout.write(f"| a harmonic of 0.06 mm: {name} | {axis:.0f} | {region:.1f} | | |\n")
    assert 93.5 <= region <= 96.5, region
    assert axis <= 92.5, axis
