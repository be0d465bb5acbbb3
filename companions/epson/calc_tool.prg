' calc_tool.prg: the offset of tool 1 from one picture of its tip, by a camera that looks upward.
' SPDX-License-Identifier: 0BSD
'
' Needs Vision Guide: a sequence findTip with an object tip, and a calibration of the camera as
' fixed and looking upward. Bring the tip before the camera first, by any tool. The flange stands
' upright: for robots of four axes. True if the tip was found and tool 1 was set; else tool 1 is
' as it was. The tool that was in force is in force again afterwards.

Function CalcTool As Boolean
  Boolean found
  Double x, y, u, x0, y0, u0, xTool, yTool, zTool, uTool, rTool, theta
  Integer toolBefore

  CalcTool = False
  toolBefore = Tool
  OnErr GoTo failed
  Tool 0
  VRun findTip
  VGet findTip.tip.RobotXYU, found, x, y, u
  If found Then
    x0 = CX(Here)
    y0 = CY(Here)
    u0 = CU(Here)

    xTool = x - x0
    yTool = y - y0
    theta = Atan2(xTool, yTool) - DegToRad(u0)
    rTool = Sqr(xTool * xTool + yTool * yTool)
    xTool = Cos(theta) * rTool
    yTool = Sin(theta) * rTool

    zTool = 0
    uTool = 0
    If TLDef(1) <> 0 Then
      zTool = CZ(TLSet(1))
      uTool = CU(TLSet(1))
    EndIf
    TLSet 1, XY(xTool, yTool, zTool, uTool)
    CalcTool = True
  EndIf
ended:
  OnErr GoTo 0
  Tool toolBefore
  Exit Function

failed:
  EResume ended
Fend
