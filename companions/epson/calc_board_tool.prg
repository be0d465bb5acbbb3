' calc_board_tool.prg: the frame of a held board as tool 1, from pictures of two fiducials.
' SPDX-License-Identifier: 0BSD
'
' Needs Vision Guide: sequences SearchFid1 and SearchFid2 with an object Corr01 each, a
' calibration of the camera as fixed and looking upward, and points Fid1CamPos and Fid2CamPos
' with each fiducial before the camera, taught with Tool 0 selected. The flange stands upright:
' for robots of four axes. The origin is half way between the fiducials, X points from 2 to 1:
' exchanged, they turn the tool by 180 degrees.
' It moves the robot. True if both were found and tool 1 was set; else tool 1 is as it was. The
' tool that was in force is in force again afterwards.

Function CalcBoardTool As Boolean
  Boolean found
  Double fidX, fidY, fidU, r, robX, robY, robU, x, y, z, theta
  Double toolX1, toolY1, toolX2, toolY2, toolU
  Integer toolBefore

  CalcBoardTool = False
  toolBefore = Tool
  OnErr GoTo failed
  Tool 0

  Jump Fid1CamPos
  robX = CX(Fid1CamPos)
  robY = CY(Fid1CamPos)
  robU = CU(Fid1CamPos)
  VRun SearchFid1
  VGet SearchFid1.Corr01.RobotXYU, found, fidX, fidY, fidU
  If Not found Then GoTo ended
  x = fidX - robX
  y = fidY - robY
  theta = Atan2(x, y) - DegToRad(robU)
  r = Sqr(x ** 2 + y ** 2)
  toolX1 = Cos(theta) * r
  toolY1 = Sin(theta) * r

  Jump Fid2CamPos
  robX = CX(Fid2CamPos)
  robY = CY(Fid2CamPos)
  robU = CU(Fid2CamPos)
  VRun SearchFid2
  VGet SearchFid2.Corr01.RobotXYU, found, fidX, fidY, fidU
  If Not found Then GoTo ended
  x = fidX - robX
  y = fidY - robY
  theta = Atan2(x, y) - DegToRad(robU)
  r = Sqr(x ** 2 + y ** 2)
  toolX2 = Cos(theta) * r
  toolY2 = Sin(theta) * r

  x = (toolX1 + toolX2) / 2
  y = (toolY1 + toolY2) / 2
  toolU = RadToDeg(Atan2(toolX1 - toolX2, toolY1 - toolY2))
  z = 0
  If TLDef(1) <> 0 Then
    z = CZ(TLSet(1))
  EndIf
  TLSet 1, XY(x, y, z, toolU)
  CalcBoardTool = True
ended:
  OnErr GoTo 0
  Tool toolBefore
  Exit Function

failed:
  EResume ended
Fend
