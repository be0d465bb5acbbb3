"""Runs vision sequences on pictures of the simulated world, and returns their results.

Source: docs/reference/vision.md 1, 2, 4.
"""

import math
import random
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Final

from robolink.errors import ConfigError
from robolink.model import TIP, Pose
from robolink_simulators.cell.places import Pixel
from robolink_simulators.cell.workplace import Workplace
from robolink_simulators.epson.camera_calibrations import CameraMounting, VisionCalibration
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.vision_project import (
    VisionObject,
    VisionProject,
    VisionSequence,
    VisionValue,
    bitmap,
)

__all__ = ["VisionSystem"]

_FIDUCIAL: Final = TIP + 1
_EXPOSED_MS: Final = 33
_US_PER_MS: Final = 1000
_ALONG_X: Final = (1.0, 0.0, 0.0)
_SCORES: Final = (850, 999)
"""Lowest and highest score of a find (assumed). The best comes first, so either of two similar
marks may.
"""

_ONLY_CAMERA: Final = 1

RESULTS: Final[Mapping[str, int]] = {
    "found": 1,
    "passed": 1,
    "numberfound": 1,
    "score": 1,
    "angle": 1,
    "time": 1,
    "pixelx": 1,
    "pixely": 1,
    "pixelxyu": 4,
    "camerax": 1,
    "cameray": 1,
    "cameraxyu": 4,
    "robotx": 1,
    "roboty": 1,
    "robotu": 1,
    "robotxyu": 4,
    "robottoolxyu": 4,
}
"""Results of objects by lower-case name, each with the number of variables that it fills."""

OF_A_SEQUENCE: Final = frozenset({"allfound", "allpassed", "time"})
"""Results of sequences, by lower-case name."""

_PARTS: Final = {"x": 0, "y": 1, "u": 2}


@dataclass(frozen=True, slots=True)
class VisionFind:
    """A mark in a picture.

    Attributes:
        pixel: Where.
        angle_deg: How its X axis lies, from the image's first axis to its second.
        score: How alike it is, 0 to 1000.
    """

    pixel: Pixel
    angle_deg: float
    score: int


@dataclass(frozen=True, slots=True)
class VisionPicture:
    """A picture in the memory of the vision system.

    Attributes:
        tips: The tips in it, best first.
        fiducials: The fiducials.
        flange: Where the flange was.
    """

    tips: tuple[VisionFind, ...]
    fiducials: tuple[VisionFind, ...]
    flange: Pose

    def of(self, mark: int) -> tuple[VisionFind, ...]:
        """Return what looks like the tip, or like a fiducial."""
        return self.tips if mark == TIP else self.fiducials


@dataclass(frozen=True, slots=True)
class SequenceOutcome:
    """The results of a sequence's last run.

    Attributes:
        picture: What it looked at.
        finds: What each object found, by its name in lower case.
        took_ms: How long it took, with the picture.
        object_ms: How long an object took.
    """

    picture: VisionPicture
    finds: Mapping[str, tuple[VisionFind, ...]] = field(default_factory=dict)
    took_ms: int = 0
    object_ms: int = 0


class VisionSystem:
    """Vision Guide beside a simulated controller, with the one camera of its world.

    Args:
        project: Sequences and calibrations.
        world: What there is to see.
        options: The controller's habits.
        seed: Decides the scores.

    Attributes:
        answers: Whether the camera answers.
        runs: Sequences that were run.
    """

    def __init__(
        self,
        project: VisionProject,
        world: Callable[[], Workplace],
        options: EpsonOptions,
        *,
        seed: int = 1,
    ) -> None:
        self.project = project
        self._saved = deepcopy(project)
        self.answers = True
        self.runs = 0
        self._world = world
        self._options = options
        self._rng = random.Random(f"vision {seed}")
        self._picture: VisionPicture | None = None
        self._outcomes: dict[str, SequenceOutcome] = {}

    def run(self, name: str) -> int:
        """Run a sequence on a picture that is taken now; return how long that takes, in ms.

        Raises:
            Refusal: There is no such sequence, or no picture.
        """
        sequence = self.project.sequence(name)
        if sequence.properties.get("camera") != _ONLY_CAMERA or not self.answers:
            raise SpelRefusal(RefusalKind.VISION_CAMERA, "The camera does not answer")
        took_ms = len(sequence.objects) * self._options.vision_object_ms
        if sequence.properties.number("runtimeacquire"):
            self._picture = self._taken()
            exposure_ms = round(sequence.properties.number("exposuretime") / _US_PER_MS)
            extra = _EXPOSED_MS + exposure_ms if exposure_ms else 0
            took_ms += extra or self._options.vision_acquisition_ms
        if self._picture is None:
            raise SpelRefusal(RefusalKind.VISION_CAMERA, "There is no picture in memory")
        finds = {key: _found(one, self._picture) for key, one in sequence.objects.items()}
        each_ms = self._options.vision_object_ms
        self._outcomes[sequence.name] = SequenceOutcome(self._picture, finds, took_ms, each_ms)
        self.runs += 1
        return took_ms

    def image(self, name: str) -> bytes:
        """Return the picture that the last run of a sequence looked at, as the content of a file.

        Raises:
            Refusal: There is no such sequence, or it has not run.
        """
        outcome = self._outcomes.get(self.project.sequence(name).name)
        if outcome is None:
            raise SpelRefusal(RefusalKind.VISION_CAMERA, f"Sequence {name} has no picture")
        marks = (outcome.picture.tips, outcome.picture.fiducials)
        tips, fiducials = ([find.pixel for find in finds] for finds in marks)
        return bitmap(self._world().camera.optics.size_px, tips, fiducials)

    def save(self) -> None:
        """Keep the project as it is (VSave)."""
        self._saved = deepcopy(self.project)

    def load(self) -> None:
        """Restore the project as stored, without later settings; results are lost (VLoad)."""
        self.project = deepcopy(self._saved)
        self._outcomes.clear()
        self._picture = None

    def taught_poses(self, calibration: str) -> tuple[Pose, ...]:
        """Return the poses at which a calibration looks.

        Raises:
            Refusal: There is no such calibration, or none was taught.
        """
        poses = self.project.taught.get(calibration.lower())
        if poses is None:
            text = f"Calibration {calibration} has no taught points"
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, text)
        return poses

    def target(self) -> Pixel:
        """Return where the best tip of a new picture is, as a calibration looks for its target.

        Raises:
            Refusal: The camera does not answer, or there is none to be seen.
        """
        if not self.answers:
            raise SpelRefusal(RefusalKind.VISION_CAMERA, "The camera does not answer")
        tips = self._taken().tips
        if not tips:
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, "The target is not to be seen")
        return tips[0].pixel

    def calibrate(
        self, calibration: str, pixels: Sequence[Pixel], places_mm: Sequence[tuple[float, float]]
    ) -> None:
        """Complete a calibration with what was seen at each place of the robot.

        Raises:
            Refusal: The places do not calibrate a camera.
        """
        name = calibration.lower()
        mounting = self.project.calibrations[name].mounting
        try:
            found = VisionCalibration.of_points(pixels, places_mm)
        except ConfigError as error:
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, str(error)) from error
        self.project.calibrations[name] = replace(found, mounting=mounting)

    def get(self, path: tuple[str, ...], index: int | None) -> tuple[VisionValue | None, ...]:
        """Return a property or a result; ``None`` where a variable keeps what it holds.

        Args:
            path: Sequence, object (if any) and name, the last in lower case.
            index: Which find, from 1; by default the property CurrentResult.

        Raises:
            Refusal: There is nothing of that name, or no calibration for it.
        """
        sequence, name = self.project.sequence(path[0]), path[-1]
        if len(path) == 2:
            if name in OF_A_SEQUENCE:
                return (self._of_sequence(sequence, name),)
            return (sequence.properties.get(name),)
        one = sequence.object(path[1])
        if name not in RESULTS:
            return (one.properties.get(name),)
        wanted = int(one.properties.number("currentresult")) if index is None else index
        if wanted < 1:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"There is no result {wanted}")
        return self._result(sequence, one, name, wanted)

    def set(self, path: tuple[str, ...], value: VisionValue) -> None:
        """Change a property.

        Raises:
            Refusal: There is nothing of that name, or it takes another kind of value.
        """
        sequence = self.project.sequence(path[0])
        owner = sequence if len(path) == 2 else sequence.object(path[1])
        owner.properties.set(path[-1], value)

    def _taken(self) -> VisionPicture:
        world = self._world()
        tips, fiducials = (self._seen(world, mark) for mark in (TIP, _FIDUCIAL))
        return VisionPicture(tips, fiducials, world.told_flange())

    def _seen(self, world: Workplace, mark: int) -> tuple[VisionFind, ...]:
        marks = world.marks(mark)
        (a, b), (c, d) = world.camera.optics.mm_per_px
        area = a * d - b * c
        finds = list[VisionFind]()
        # Fiducials are searched for in the picture taken for the tip.
        pixels = world.camera.finds((place for place, _ in marks), exposes=mark == TIP)
        # A finder may report a mark where there is none.
        directions = [axis for _, axis in marks] or [_ALONG_X] * len(pixels)
        for pixel, (dx, dy, _) in zip(pixels, directions, strict=True):
            if pixel is not None:
                along, across = (d * dx - b * dy) / area, (a * dy - c * dx) / area
                angle_deg = math.degrees(math.atan2(across, along))
                finds.append(VisionFind(pixel, angle_deg, self._rng.randint(*_SCORES)))
        return tuple(sorted(finds, key=lambda find: -find.score))

    def _of_sequence(self, sequence: VisionSequence, name: str) -> VisionValue:
        outcome = self._outcomes.get(sequence.name)
        if name == "time":
            return outcome.took_ms if outcome else 0
        return outcome is not None and all(outcome.finds.values())

    def _result(
        self, sequence: VisionSequence, one: VisionObject, name: str, wanted: int
    ) -> tuple[VisionValue | None, ...]:
        outcome = self._outcomes.get(sequence.name)
        finds = outcome.finds[one.name.lower()] if outcome else ()
        found = finds[wanted - 1] if wanted <= len(finds) else None
        if name == "numberfound":
            return (len(finds),)
        if name == "time":
            return (outcome.object_ms if outcome else 0,)
        if name in ("found", "passed"):
            return (found is not None,)
        calibration = self._calibration(sequence, name)
        if found is None or outcome is None:
            missing = 0.0 if self._options.vision_not_found == "zero" else None
            return (missing,) if RESULTS[name] == 1 else (False, missing, missing, missing)
        if name == "score":
            return (found.score,)
        place = _place(one, name, found, outcome.picture.flange, calibration)
        if name.endswith("xyu"):
            return (True, *place)
        return (place[2 if name == "angle" else _PARTS[name[-1]]],)

    def _calibration(self, sequence: VisionSequence, name: str) -> VisionCalibration | None:
        """Return the calibration that a result needs, ``None`` where there is none."""
        if not name.startswith(("robot", "camera")):
            return None
        named = str(sequence.properties.get("calibration")).lower()
        if not named:
            if name.startswith("robot") and self._options.uncalibrated_robot_result == "zero":
                return None
            text = f"Sequence {sequence.name} has no calibration"
            raise SpelRefusal(RefusalKind.VISION_UNCALIBRATED, text)
        found = self.project.calibrations.get(named)
        if found is None or not found.complete:
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, f"{named} is not complete")
        if name == "robottoolxyu" and found.mounting is not CameraMounting.FIXED_UPWARD:
            raise SpelRefusal(RefusalKind.VISION_CALIBRATION, f"{named} does not look upward")
        return found


def _found(one: VisionObject, picture: VisionPicture) -> tuple[VisionFind, ...]:
    most = int(one.properties.number("numbertofind"))
    finds = picture.of(one.mark)
    return finds[:most] if most else finds


def _place(
    one: VisionObject,
    name: str,
    find: VisionFind,
    flange: Pose,
    calibration: VisionCalibration | None,
) -> tuple[float, float, float]:
    """Return where a mark is, as its result has it: image, camera, robot or tool."""
    if not name.startswith(("robot", "camera")):
        return (*find.pixel, find.angle_deg)
    if calibration is None:
        return (0.0, 0.0, 0.0)
    if name.startswith("camera"):
        return (*calibration.camera_mm(find.pixel), find.angle_deg)
    x_mm, y_mm = calibration.robot_mm(find.pixel)
    u_deg = _wrapped(calibration.robot_deg(find.angle_deg) + one.properties.number("robotuoffset"))
    if name != "robottoolxyu":
        return (x_mm, y_mm, u_deg)
    dx, dy = x_mm - flange.x_mm, y_mm - flange.y_mm
    cos, sin = math.cos(math.radians(flange.u_deg)), math.sin(math.radians(flange.u_deg))
    return (dx * cos + dy * sin, dy * cos - dx * sin, _wrapped(u_deg - flange.u_deg))


def _wrapped(angle_deg: float) -> float:
    return (angle_deg + 180.0) % 360.0 - 180.0
