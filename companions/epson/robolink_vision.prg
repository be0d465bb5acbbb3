' robolink_vision.prg: takes a picture for a PC and publishes where the tip, or a fiducial, is.
' SPDX-License-Identifier: 0BSD
'
' Needs Vision Guide: a sequence findTip with an object tip; for held boards sequences
' SearchFid1, SearchFid2 ... with an object Corr01 each. NumberToFind of each object is 0 (all),
' so that two candidates are seen to be two. The sequences have a calibration. Change the names
' below to yours.
'
' The PC starts main7 over Remote Ethernet while the robot stands still; no other task may run
' then. It moves nothing and sets no tool. A reader takes robolink_look_end first and
' robolink_look_begin last; if they are equal, what it read between them is whole.

Global Preserve Long robolink_look_mark    ' set by the PC: 0 the tip, else number of a fiducial
Global Preserve Long robolink_look_begin
Global Preserve Long robolink_look_end
Global Preserve Long robolink_look_error   ' 0, or the number of the error that ended the look
Global Preserve Long robolink_look_count   ' candidates
Global Preserve Double robolink_look_xy(31)  ' X Y of candidate n, from 0, at 2 * n; mm, base

Function main7
  Call RobolinkLook
Fend

Function RobolinkLook
  Boolean found
  Integer i, n
  Long seen, count, failure
  Double x, y, u
  String seq$, obj$

  seen = 0
  failure = 0
  count = 1
  If robolink_look_end < 1000000000 Then
    count = robolink_look_end + 1
  EndIf
  robolink_look_begin = count
  OnErr GoTo failed

  seq$ = "findTip"
  obj$ = "tip"
  If robolink_look_mark > 0 Then
    seq$ = "SearchFid" + LTrim$(Str$(robolink_look_mark))
    obj$ = "Corr01"
  EndIf
  VRun seq$
  VGet seq$.obj$.NumberFound, n
  If n > 16 Then
    n = 16
  EndIf
  For i = 1 To n
    VGet seq$.obj$.RobotXYU(i), found, x, y, u
    If found Then
      robolink_look_xy(2 * seen) = x
      robolink_look_xy(2 * seen + 1) = y
      seen = seen + 1
    EndIf
  Next i
ended:
  OnErr GoTo 0
  robolink_look_error = failure
  robolink_look_count = seen
  robolink_look_end = count
  Exit Function

failed:
  failure = Err
  seen = 0
  EResume ended
Fend
