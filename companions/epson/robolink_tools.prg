' robolink_tools.prg: publishes the tool table to a PC that may only monitor.
' SPDX-License-Identifier: 0BSD
'
' Add this file to the RC+ project, build it, and write
'     Call RobolinkPublish
' in a normal task: at its start, and after each Tool, TLSet and TLClr of your own. Call it
' from one task only, and not from a background or NoEmgAbort task.
'
' It moves nothing, waits for nothing and sets no tool. It stores a value only when one has
' changed. A reader takes robolink_end first and robolink_begin last; if they are equal,
' what it read between them is whole.

Global Preserve Long robolink_begin
Global Preserve Long robolink_end
Global Preserve Long robolink_state(18)   ' 0 layout, 1 robot, 2 tool in force, 3+n: tool n defined
Global Preserve Double robolink_tool(89)  ' X Y Z U V W of tool n from (n - 1) * 6

Function RobolinkPublish
  Integer n, i, sixAxes, changed
  Long state(18)
  Double value(89)

  sixAxes = 0
  If RobotType = 5 Or RobotType = 7 Then
    sixAxes = 1
  EndIf

  For i = 0 To 89
    value(i) = 0
  Next i
  state(0) = 1
  state(1) = Robot
  state(2) = Tool
  state(3) = 0
  For n = 1 To 15
    i = (n - 1) * 6
    state(3 + n) = 0
    If TLDef(n) <> 0 Then
      state(3 + n) = 1
      value(i) = CX(TLSet(n))
      value(i + 1) = CY(TLSet(n))
      value(i + 2) = CZ(TLSet(n))
      value(i + 3) = CU(TLSet(n))
      If sixAxes = 1 Then
        value(i + 4) = CV(TLSet(n))
        value(i + 5) = CW(TLSet(n))
      EndIf
    EndIf
  Next n

  changed = 0
  If robolink_begin <> robolink_end Then
    changed = 1
  EndIf
  For i = 0 To 18
    If robolink_state(i) <> state(i) Then
      changed = 1
    EndIf
  Next i
  For i = 0 To 89
    If robolink_tool(i) <> value(i) Then
      changed = 1
    EndIf
  Next i

  If changed = 1 Then
    If robolink_begin < 1000000000 Then
      robolink_begin = robolink_begin + 1
    Else
      robolink_begin = 1
    EndIf
    For i = 0 To 18
      robolink_state(i) = state(i)
    Next i
    For i = 0 To 89
      robolink_tool(i) = value(i)
    Next i
    robolink_end = robolink_begin
  EndIf
Fend
