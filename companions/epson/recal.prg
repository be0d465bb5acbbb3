' recal.prg: a running program measures a tool, and robolink decides whether it is kept.
' SPDX-License-Identifier: 0BSD
'
' Add this file to the RC+ project. docs/spel-callback.md of robolink says what to call where:
'
'     RobolinkRestore                      first of all in main, before anything moves
'     RobolinkOpen("192.168.0.20", 5001)   at a safe point; then
'     RobolinkBegin(1, "n-angle")
'     RobolinkApproach(8)                  before each touch, tip clear of the pin: input 8 is off
'     RobolinkTouch(8)                     at the touch: input 8 is on
'     RobolinkWrite                        asks for the value, keeps the old one, writes
'     RobolinkApproach, RobolinkTouch      again, at other angles: the proof
'
' In place of touches, with RobolinkBegin(1, "beams@NAME") or RobolinkBegin(1, "camera"):
'
'     RobolinkApproach(8), then twice RobolinkEdge(1, 8)   beam 1 on input 8: broken, free again
'     RobolinkSeen(n, x, y)                robot at rest: n candidates, and where the one is, RobotXYU;
'                                          beside each place first, then at it
'     RobolinkFinish                       keeps the new value, or puts the old one back
'     RobolinkClose                        in any case
'
' Each but the first and last gives False when it came to nothing. It moves nothing. Call it from
' one normal task only. Port 201 and timer 60 are its own.

#define RL_PORT 201
#define RL_TIMER 60
#define RL_WAIT_S 10

Global Preserve Integer rl_flag    ' 0 none, 1 old value must come back, 2 kept, 3 put back
Global Preserve Integer rl_robot   ' the robot of the last change
Global Preserve Integer rl_tool    ' its tool
Global Preserve Double rl_old(5)   ' what it held before
Global Preserve Double rl_new(5)   ' what was written
Global Preserve String rl_op$      ' the name of the last change

Global Integer rl_stop             ' 1: RobolinkClose ends the program if nothing was kept
Global Integer rl_kept             ' 1: the last calibration was kept
Global String rl_code$             ' why the last one was not

Global Integer rl_open
Global Integer rl_number
Global Integer rl_clear
Global Integer rl_level
Global Integer rl_proof
Global String rl_word$
Global String rl_field$(15)

' Puts the old value back where a cut came before the new one was proved. A tool that holds neither
' was set by somebody else since: it is left.
Function RobolinkRestore
  Integer r
  If rl_flag = 1 Then
    r = Robot
    RlChoose rl_robot
    If RlOurs() Then
      RlPutBack
    EndIf
    rl_flag = 3
    RlChoose r
  EndIf
Fend

Function RobolinkOpen(host$ As String, port As Integer) As Boolean
  Integer r
  RobolinkOpen = False
  RobolinkRestore
  rl_kept = 0
  rl_code$ = "no_answer"
  rl_proof = 0
  rl_clear = 0
  r = Robot
  If rl_flag <> 0 And rl_robot <> r Then
    ' What another robot has to tell is told under that robot's name.
    RlChoose rl_robot
    RlHello host$, port
    RlBye
    RlChoose r
    If rl_flag <> 0 Then
      Exit Function
    EndIf
  EndIf
  RobolinkOpen = RlHello(host$, port)
Fend

Function RobolinkBegin(n As Integer, method$ As String) As Boolean
  RobolinkBegin = False
  If rl_open = 1 And rl_flag = 0 Then
    If RlAsk("BEGIN," + Str$(n) + "," + method$ + "," + RlTool$(n)) Then
      If rl_word$ = "GO" Then
        rl_tool = n
        rl_robot = Robot
        RobolinkBegin = True
      EndIf
    EndIf
  EndIf
Fend

' Notes what the input shows while the tip is clear of the pin, or of the beam.
Function RobolinkApproach(bit As Integer)
  rl_level = Sw(bit)
  rl_clear = 0
  If Sw(bit) = Off Then
    rl_clear = 1
  EndIf
Fend

' Sends where the robot stands, in the tool that is in force, and what the contact shows.
Function RobolinkTouch(bit As Integer) As Boolean
  Integer touched, clear
  touched = 0
  If Sw(bit) = On Then
    touched = 1
  EndIf
  clear = rl_clear
  rl_clear = 0
  RobolinkTouch = RlSend(Str$(clear) + "," + Str$(touched))
Fend

' Sends where the robot stands at an edge of a beam, and what its input showed before and shows now.
Function RobolinkEdge(beam As Integer, bit As Integer) As Boolean
  Integer before
  before = rl_level
  rl_level = Sw(bit)
  RobolinkEdge = RlSend(Str$(beam) + "," + Str$(before) + "," + Str$(rl_level))
Fend

' Sends where the robot stands, how many candidates its camera saw, and where the one is.
Function RobolinkSeen(n As Integer, x As Double, y As Double) As Boolean
  RobolinkSeen = RlSend(Str$(n) + "," + RlNumber$(x) + "," + RlNumber$(y))
Fend

' Asks for the value and writes it. From here on the old value comes back unless it is proved.
Function RobolinkWrite As Boolean
  Integer i
  RobolinkWrite = False
  If Robot <> rl_robot Then
    Exit Function
  EndIf
  If RlAsk("SOLVE") Then
    If rl_word$ = "VALUE" Then
      RlRead ByRef rl_old()
      For i = 0 To 5
        rl_new(i) = Val(rl_field$(i + 1)) / 1000
      Next i
      rl_op$ = rl_field$(0)
      rl_flag = 1
      RlSetTool rl_tool, rl_new(0), rl_new(1), rl_new(2), rl_new(3), rl_new(4), rl_new(5)
      RlRead ByRef rl_new()
      If RlAsk("WROTE," + rl_op$ + "," + RlTool$(rl_tool)) Then
        If rl_word$ = "PROVE" Then
          rl_proof = 1
          RobolinkWrite = True
          Exit Function
        EndIf
      EndIf
      RlGiveUp
    EndIf
  EndIf
Fend

Function RobolinkFinish As Boolean
  RobolinkFinish = False
  If rl_flag = 1 And Robot = rl_robot Then
    If RlAsk("JUDGE," + rl_op$) Then
      If rl_word$ = "KEEP" And rl_field$(0) = rl_op$ Then
        rl_flag = 2
        rl_kept = 1
        rl_code$ = ""
        RobolinkFinish = True
        If RlAsk("KEPT," + rl_op$ + "," + RlTool$(rl_tool)) Then
          If rl_word$ = "DONE" Then
            rl_flag = 0
          EndIf
        EndIf
        Exit Function
      EndIf
    EndIf
    RlGiveUp
  EndIf
Fend

Function RobolinkClose
  If rl_flag = 1 Then
    RlGiveUp
  EndIf
  RlBye
  If rl_stop = 1 And rl_kept = 0 Then
    Error 8101
  EndIf
Fend

' What follows is for the functions above only.

Function RlGiveUp
  String code$
  Integer r
  code$ = rl_code$
  r = Robot
  RlChoose rl_robot
  RlPutBack
  rl_flag = 3
  If RlAsk("RESTORED," + rl_op$ + "," + RlTool$(rl_tool)) Then
    If rl_word$ = "DONE" Then
      rl_flag = 0
    EndIf
  EndIf
  RlChoose r
  rl_code$ = code$
Fend

Function RlPutBack
  RlSetTool rl_tool, rl_old(0), rl_old(1), rl_old(2), rl_old(3), rl_old(4), rl_old(5)
Fend

' True while the tool holds what was written here.
Function RlOurs As Boolean
  Integer i
  Double now(5)
  RlOurs = False
  If TLDef(rl_tool) = 0 Then
    Exit Function
  EndIf
  RlRead ByRef now()
  For i = 0 To 5
    If Abs(now(i) - rl_new(i)) > 0.0015 Then
      Exit Function
    EndIf
  Next i
  RlOurs = True
Fend

Function RlRead(ByRef v() As Double)
  v(0) = CX(TLSet(rl_tool))
  v(1) = CY(TLSet(rl_tool))
  v(2) = CZ(TLSet(rl_tool))
  v(3) = CU(TLSet(rl_tool))
  v(4) = 0
  v(5) = 0
  If RlSixAxes() Then
    v(4) = CV(TLSet(rl_tool))
    v(5) = CW(TLSet(rl_tool))
  EndIf
Fend

Function RlChoose(n As Integer)
  If Robot <> n Then
    Robot n
  EndIf
Fend

' Says who the robot in force is, and what it had to tell.
Function RlHello(host$ As String, port As Integer) As Boolean
  String op$
  RlHello = False
  rl_number = 0
  op$ = rl_op$
  If op$ = "" Then
    op$ = "-"
  EndIf
  If RlConnect(host$, port) Then
    If RlAsk("HELLO," + RobotSerial$ + "," + Str$(Robot) + "," + Str$(rl_flag) + "," + op$ + "," + Str$(rl_tool) + "," + RlTool$(rl_tool)) Then
      If rl_word$ = "WELCOME" Then
        rl_flag = 0
        RlHello = True
      EndIf
    EndIf
  EndIf
Fend

Function RlBye
  If rl_open = 1 Then
    RlAsk("BYE")
    CloseNet #RL_PORT
    rl_open = 0
  EndIf
Fend

' Sends where the robot stands, and what was seen there.
Function RlSend(seen$ As String) As Boolean
  String text$
  RlSend = False
  If Robot <> rl_robot Then
    Exit Function
  EndIf
  text$ = "POSE,"
  If rl_proof = 1 Then
    text$ = "PROOF,"
  EndIf
  text$ = text$ + Str$(Tool) + "," + RlNumber$(CX(Here)) + "," + RlNumber$(CY(Here)) + "," + RlNumber$(CZ(Here)) + "," + RlNumber$(CU(Here))
  If RlSixAxes() Then
    text$ = text$ + "," + RlNumber$(CV(Here)) + "," + RlNumber$(CW(Here))
  Else
    text$ = text$ + ",0,0"
  EndIf
  If RlAsk(text$ + "," + seen$) Then
    If rl_word$ = "OK" Then
      RlSend = True
    EndIf
  EndIf
Fend

Function RlConnect(host$ As String, port As Integer) As Boolean
  RlConnect = False
  OnErr GoTo RlConnectFailed
  CloseNet #RL_PORT
  rl_open = 0
  SetNet #RL_PORT, host$, port, CRLF, NONE, RL_WAIT_S
  OpenNet #RL_PORT As Client
  rl_open = 1
  WaitNet #RL_PORT, RL_WAIT_S
  If TW = False Then
    RlConnect = True
  EndIf
RlConnectEnd:
  OnErr GoTo 0
  Exit Function
RlConnectFailed:
  EResume RlConnectEnd
Fend

' Sends a line and takes its answer apart; False, and no link any more, without a right one.
Function RlAsk(text$ As String) As Boolean
  String line$, body$
  Integer at, count, i
  String part$(0)
  RlAsk = False
  rl_word$ = ""
  If rl_open = 0 Then
    Exit Function
  EndIf
  OnErr GoTo RlAskFailed
  rl_number = rl_number + 1
  line$ = "RL1," + Str$(rl_number) + "," + text$
  line$ = line$ + "*" + Hex$(RlSum(line$))
  Print #RL_PORT, line$
  TmReset RL_TIMER
  Do While Lof(RL_PORT) < 1
    If ChkNet(RL_PORT) < 0 Or Tmr(RL_TIMER) > RL_WAIT_S Then
      GoTo RlAskLost
    EndIf
    Wait 0.02
  Loop
  Line Input #RL_PORT, line$
  at = InStr(line$, "*")
  If at < 2 Then
    GoTo RlAskLost
  EndIf
  body$ = Left$(line$, at - 1)
  If Mid$(line$, at + 1) <> Hex$(RlSum(body$)) Then
    GoTo RlAskLost
  EndIf
  count = ParseStr(body$, part$(), ",")
  If count < 3 Then
    GoTo RlAskLost
  EndIf
  If part$(0) <> "RL1" Or part$(1) <> Str$(rl_number) Then
    GoTo RlAskLost
  EndIf
  For i = 0 To 15
    rl_field$(i) = ""
    If i + 3 < count Then
      rl_field$(i) = part$(i + 3)
    EndIf
  Next i
  rl_word$ = part$(2)
  If rl_word$ = "REFUSE" Or rl_word$ = "BACK" Then
    rl_code$ = rl_field$(0)
  EndIf
  OnErr GoTo 0
  RlAsk = True
  Exit Function
RlAskFailed:
  EResume RlAskLost
RlAskLost:
  OnErr GoTo 0
  CloseNet #RL_PORT
  rl_open = 0
Fend

Function RlSum(text$ As String) As Long
  Integer i
  Long sum
  sum = 0
  For i = 1 To Len(text$)
    sum = (sum * 251 + Asc(Mid$(text$, i, 1))) Mod 8388593
  Next i
  RlSum = sum
Fend

Function RlNumber$(value As Double) As String
  Long whole
  whole = Int(value * 1000 + 0.5)
  RlNumber$ = Str$(whole)
Fend

Function RlTool$(n As Integer) As String
  RlTool$ = "0,0,0,0,0,0,0"
  If n > 0 Then
    If TLDef(n) <> 0 Then
      RlTool$ = "1," + RlNumber$(CX(TLSet(n))) + "," + RlNumber$(CY(TLSet(n))) + "," + RlNumber$(CZ(TLSet(n))) + "," + RlNumber$(CU(TLSet(n)))
      If RlSixAxes() Then
        RlTool$ = RlTool$ + "," + RlNumber$(CV(TLSet(n))) + "," + RlNumber$(CW(TLSet(n)))
      Else
        RlTool$ = RlTool$ + ",0,0"
      EndIf
    EndIf
  EndIf
Fend

Function RlSixAxes As Boolean
  RlSixAxes = False
  If RobotType = 5 Or RobotType = 7 Then
    RlSixAxes = True
  EndIf
Fend

Function RlSetTool(n As Integer, x As Double, y As Double, z As Double, u As Double, v As Double, w As Double)
  If RlSixAxes() Then
    TLSet n, XY(x, y, z, u, v, w)
  Else
    TLSet n, XY(x, y, z, u)
  EndIf
Fend
