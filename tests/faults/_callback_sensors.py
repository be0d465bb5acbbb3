"""Cells whose program calls back with edges of two beams, or with sightings of its camera."""

import math
from dataclasses import replace

from robolink_simulators.cell.tip_switches import LightBeam
from robolink_simulators.cell.workplace import exchanged
from robolink_simulators.epson.camera_calibrations import VisionCalibration
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.vision_project import VisionObject, VisionProject, VisionSequence
from robolink_simulators.epson.vision_system import VisionSystem
from robolink_simulators.epson.world import STORED_ON_SIX_AXES

from robolink.calibration import Beam
from robolink.methods.beams import BeamsParameters
from robolink.methods.beams.drive import BeamDrive
from robolink.model import TIP, Pose, ToolOffset
from robolink.stations import BeamStation, Found, StationKind, station_entry
from tests.faults._callback_cell import IDENTITY, NOMINAL, CallbackCell, main_of

HEADINGS = (3.0, 88.0)
BEAM_INPUTS = (3, 4)
MEASURED_U, PROVED_U = 20.0, 160.0
SHAFT_MM = 3.0
FIRST, PROOF = 100, 200
CROSSED, PROVED_BY = 12, 4
"""Each beam is crossed both ways twice and deeper once; once more in the turn test."""

_CROSSING = f"""
Function CrossAll(first As Integer, count As Integer) As Boolean
  Integer i, a, beam, bit
  CrossAll = True
  SpeedS 5                    ' slow enough to come to rest within the beam
  Tool 0
  For i = 0 To count - 1
    a = first + 2 * i
    beam = 1
    If CX(P(a + 40)) > 1 Then
      beam = 2
    EndIf
    bit = beam + {BEAM_INPUTS[0] - 1}
    If CrossAll Then
      Go P(a) +Z(15)
      Go P(a)
      RobolinkApproach(bit)
      Move P(a + 1) Till Sw(bit) = On
      CrossAll = RobolinkEdge(beam, bit)
      If CrossAll Then
        Move P(a + 1) Till Sw(bit) = Off
        CrossAll = RobolinkEdge(beam, bit)
      EndIf
      Go Here +Z(15)
    EndIf
  Next i
  Tool 1
Fend
"""

LOOKS = (0.0, 85.0, -85.0, 150.0)
PROVING_LOOKS = (40.0, -40.0, 110.0)
_LOOKING = """
Function LookAll(first As Integer, last As Integer, using As Integer) As Boolean
  Integer i
  LookAll = True
  Tool using
  For i = first To last
    If LookAll Then
      Go P(i) -X(1) -Y(1)
      LookAll = LookOnce()
    EndIf
    If LookAll Then
      Go P(i)
      LookAll = LookOnce()
    EndIf
  Next i
  Tool 1
Fend

Function LookOnce() As Boolean
  Integer n
  Boolean found
  Double x, y, u
  VRun findTip
  VGet findTip.tip.NumberFound, n
  x = 0
  y = 0
  If n > 0 Then
    VGet findTip.tip.RobotXYU(1), found, x, y, u
  EndIf
  LookOnce = RobolinkSeen(n, x, y)
Fend
"""


class BeamCell(CallbackCell):
    """Two crossed beams, recorded as they were learnt.

    Attributes:
        place_mm: The place where they really cross.
        station: The record.
    """

    main = main_of(
        "beams@gate", f"CrossAll({FIRST}, {CROSSED})", f"CrossAll({PROOF}, {PROVED_BY})", _CROSSING
    )

    def furnish(self):
        x, y, z = self.simulator.world.tip_mm()
        self.recorded_mm = (x + 4.0, y - 4.0, z - 6.0)
        self.stand_at(self.recorded_mm)
        place = self.recorded_mm
        first, second = (Beam(*place[:2], heading, sigma_mm=0.002) for heading in HEADINGS)
        self.station = BeamStation((first, second), place[2], BEAM_INPUTS)
        lines = [
            {"x_mm": b.x_mm, "y_mm": b.y_mm, "direction_deg": b.direction_deg, "input": number}
            for b, number in zip((first, second), BEAM_INPUTS, strict=True)
        ]
        found = Found(
            id="gate",
            kind=StationKind.BEAMS,
            x_mm=place[0],
            y_mm=place[1],
            z_mm=place[2],
            sigma_mm=0.002,
            details={"beams": lines},
        )
        log = self.journal.log(IDENTITY)
        log.append(station_entry(found))
        log.close()

    def stand_at(self, place_mm):
        """Mount the beams so that they cross at a place."""
        world = self.simulator.world
        for number, heading in zip(BEAM_INPUTS, HEADINGS, strict=True):
            world.disconnect(number)
            world.connect(number, LightBeam(place_mm, heading), noise_mm=0.002)

    def bring(self):
        scans = self.scans(MEASURED_U)
        self.store(FIRST, [*scans, *self.scans(MEASURED_U, deeper_mm=SHAFT_MM)[:4]])
        self.store(PROOF, self.scans(PROVED_U)[:4])

    def scans(self, u_deg, *, deeper_mm=0.0):
        """Return two rounds of crossings of the beams, for the nominal tip."""
        flange = self.simulator.machine.arm.flange()
        frame = Pose(0, 0, flange.z_mm, u_deg, hand=flange.hand)
        plan = BeamsParameters(search_mm=1.2)
        drive = BeamDrive(self.station, plan, frame, NOMINAL, deeper_mm)
        return [*drive.round(), *drive.round(1)]

    def store(self, first, scans):
        """Store their ends as points, and the number of the beam 40 points on."""
        points = self.simulator.machine.points
        for number, scan in enumerate(scans):
            at = first + 2 * number
            points.store(at, Point.at(scan.start))
            points.store(at + 1, Point.at(scan.end))
            points.store(at + 40, Point.at(replace(scan.start, x_mm=2.0 * scan.beam)))


_AROUND = """
Function Around(turn As Double, deeper As Double) As Boolean
  Around = RobolinkAround(21, {first}, {second}, turn, deeper)
Fend
"""


class RoundCell(BeamCell):
    """The same beams, around which the program drives by itself, one line a round."""

    main = main_of(
        "beams@gate",
        f"Around(0, {SHAFT_MM})",
        "Around(-90, 0)",
        _AROUND.format(first=BEAM_INPUTS[0], second=BEAM_INPUTS[1]),
    )
    search_mm = 2.0

    def bring(self):
        (ax, ay), (bx, by) = (beam.normal for beam in self.station.beams)
        area = ax * by - ay * bx
        x, y, z = self.recorded_mm
        for number, (first, second) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1)), start=21):
            one, other = first * self.search_mm, second * self.search_mm
            corner = Pose(
                x + (one * by - other * ay) / area,
                y + (other * ax - one * bx) / area,
                z - BeamsParameters().dip_mm,
                MEASURED_U,
                hand=self.simulator.machine.arm.flange().hand,
            )
            self.simulator.machine.points.store(number, Point.at(corner))


class SixAxisRoundCell(RoundCell):
    """The same on six axes, whose points have V, W and a posture."""

    robot = "C8-C901SR"

    def change_needle(self):
        self.simulator.world.tips[1] = exchanged(STORED_ON_SIX_AXES, self.rng)
        self.bring()

    def bring(self):
        super().bring()
        points, flange = self.simulator.machine.points, self.simulator.machine.arm.flange()
        for number in range(21, 25):
            x, y, z, *_ = points.get(number).coordinates
            points.store(number, Point.at(replace(flange, x_mm=x, y_mm=y, z_mm=z)))


class CameraCell(CallbackCell):
    """An up-looking camera that the controller's own vision system uses."""

    main = main_of(
        "camera",
        f"LookAll(11, {10 + len(LOOKS)}, 0)",
        f"LookAll(21, {20 + len(PROVING_LOOKS)}, 1)",
        _LOOKING,
    )

    def furnish(self):
        world = self.simulator.world
        world.set_up(replace(world.parameters, camera_noise_px=0.1))
        self.see(VisionCalibration.of_camera(world.camera))

    def see(self, calibration):
        """Give the controller's vision system a calibration of the camera."""
        tip = VisionObject("tip", TIP, {"NumberToFind": 0})
        project = VisionProject.of(
            [VisionSequence("findTip", [tip], {"Calibration": "up"})], up=calibration
        )
        simulator = self.simulator
        self.runner.vision = VisionSystem(project, lambda: simulator.world, simulator.options)

    def bring(self):
        self.look_from(11, LOOKS, NOMINAL)
        self.look_from(21, PROVING_LOOKS, ToolOffset())

    def look_from(self, first, angles, tip, *, beside_mm=0.0):
        """Teach points with a tip in front of the camera, in the coordinates of the used tool."""
        place = self.simulator.world.camera.middle_mm
        hand = self.simulator.machine.arm.flange().hand
        for number, u_deg in enumerate(angles, start=first):
            u_deg += self.rng.uniform(-2, 2)
            c, s = math.cos(math.radians(u_deg)), math.sin(math.radians(u_deg))
            pose = Pose(
                x_mm=place[0] + beside_mm - (c * tip.x_mm - s * tip.y_mm),
                y_mm=place[1] - (s * tip.x_mm + c * tip.y_mm),
                z_mm=place[2] - tip.z_mm,
                u_deg=u_deg,
                hand=hand,
            )
            self.simulator.machine.points.store(number, Point.at(pose))
