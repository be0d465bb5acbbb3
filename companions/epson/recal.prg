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
'     RobolinkAround(21, 8, 9, 0, 3)       or all of it: around both beams by P21 to P24, at U and
'                                          height of these points, then 3 mm deeper
'     RobolinkSeen(n, x, y)                robot at rest: n candidates, and where the one is, RobotXYU;
'                                          beside each place first, then at it
'     RobolinkFinish                       keeps the new value, or puts the old one back
'     RobolinkClose                        in any case
'
' Each but the first and last gives False when it came to nothing. Only RobolinkAround moves the
' robot. Call it from one normal task only. Port 201 and timer 60 are its own.

#define RL_PORT 201
#define RL_TIMER 60
#define RL_WAIT_S 10

' How RobolinkAround drives, always in Power Low.
#define RL_CROSSING_MM_S 8         ' through a beam
#define RL_TRAVEL_MM_S 60          ' up and down
#define RL_PERCENT 10              ' above the beams
#define RL_LIFT_MM 12              ' so far above the points it comes, turns and leaves
#define RL_TURN_DEG 15             ' it turns in steps of this, so that the tip stays above its place

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
Global Integer rl_go
Global Integer rl_free1
Global Integer rl_free2
Global Integer rl_even
Global Long rl_x
Global Long rl_y
Global Double rl_z
Global Double rl_u
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
        rl_go = 1
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

' Drives the tip around two beams and sends each round as one line. P(p) to P(p + 3) are the corners,
' local 0, as the tool in question reaches them: the first side crosses the beam of bit1, the second
' that of bit2, the others lead back. Turned by turn about the tip; then deeper, 0 for not at all.
' It ends lifted, with tool, power and speeds as before.
Function RobolinkAround(p As Integer, bit1 As Integer, bit2 As Integer, turn As Double, deeper As Double) As Boolean
  Integer used, mode, i
  Double percent(2), speeds_mm(2)
  RobolinkAround = False
  If rl_open = 0 Or rl_go = 0 Or Robot <> rl_robot Then
    Exit Function
  EndIf
  used = Tool
  mode = Power
  For i = 0 To 2
    percent(i) = Speed(i + 1)
    speeds_mm(i) = SpeedS(i + 1)
  Next i
  Power Low
  Tool rl_tool
  Speed RL_PERCENT
  SpeedS RL_TRAVEL_MM_S
  If RlReady() And RlCorners(p, deeper) Then
    RobolinkAround = RlAround(p, bit1, bit2, turn, deeper)
  Else
    rl_code$ = "not_ready"
  EndIf
  Tool used
  Speed percent(0), percent(1), percent(2)
  SpeedS speeds_mm(0), speeds_mm(1), speeds_mm(2)
  If mode = 1 Then
    Power High
  EndIf
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
  rl_go = 0
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
    rl_go = 0
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

' True with motors on, in Power Low, with the tool and the speeds that were set.
Function RlReady As Boolean
  RlReady = False
  If Motor = 1 And Power = 0 And Tool = rl_tool And Speed(1) = RL_PERCENT Then
    If Abs(SpeedS(1) - RL_TRAVEL_MM_S) < 0.001 Then
      RlReady = True
    EndIf
  EndIf
Fend

' True if four points are there, level and not turned against each other, near to each other, and of
' the hand that the arm has.
Function RlCorners(p As Integer, deeper As Double) As Boolean
  Integer i
  RlCorners = False
  If deeper < 0 Or deeper > 20 Then
    Exit Function
  EndIf
  For i = p To p + 3
    If PDef(P(i)) = False Then
      Exit Function
    EndIf
    If Hand(P(i)) <> Hand(Here) Then
      Exit Function
    EndIf
    If Abs(CX(P(i)) - CX(P(p))) > 9.9 Or Abs(CY(P(i)) - CY(P(p))) > 9.9 Then
      Exit Function
    EndIf
    If Abs(CZ(P(i)) - CZ(P(p))) > 0.001 Or Abs(CU(P(i)) - CU(P(p))) > 0.001 Then
      Exit Function
    EndIf
    If RlSixAxes() Then
      If Abs(CV(P(i)) - CV(P(p))) > 0.001 Or Abs(CW(P(i)) - CW(P(p))) > 0.001 Then
        Exit Function
      EndIf
    EndIf
  Next i
  RlCorners = True
Fend

' Comes from above, drives the rounds and leaves upward. Straight up first, then over, then down; what
' turns does so above the beams, in short steps, so that the tip stays above its place.
Function RlAround(p As Integer, bit1 As Integer, bit2 As Integer, turn As Double, deeper As Double) As Boolean
  Integer k, steps
  Double up, top
  RlAround = False
  up = CZ(P(p)) + RL_LIFT_MM
  top = CZ(Here)
  If top < up - 0.01 Then
    Move Here :Z(up)
  EndIf
  If top < up Then
    top = up
  EndIf
  Go P(p) :Z(top)
  If top > up + 0.01 Then
    Move P(p) :Z(up)
  EndIf
  If Abs(CX(RealPos) - CX(P(p))) > 0.05 Or Abs(CY(RealPos) - CY(P(p))) > 0.05 Or Abs(CZ(RealPos) - up) > 0.05 Then
    ' The point is in a local: it is not where its numbers say.
    rl_code$ = "not_ready"
    Exit Function
  EndIf
  steps = Int(Abs(turn) / RL_TURN_DEG + 0.999)
  k = 1
  Do While k <= steps
    Go P(p) :Z(up) +U(turn * k / steps)
    k = k + 1
  Loop
  rl_free1 = Sw(bit1)
  rl_free2 = Sw(bit2)
  Move P(p) +U(turn)
  RlAround = RlRound(p, bit1, bit2, turn, 0)
  If RlAround And deeper > 0 Then
    SpeedS RL_TRAVEL_MM_S
    Move P(p) -Z(deeper) +U(turn)
    RlAround = RlRound(p, bit1, bit2, turn, deeper)
  EndIf
  SpeedS RL_TRAVEL_MM_S
  Move Here :Z(up)
Fend

' Drives the four sides of one round and sends it. Where an edge does not come it sends what came. From
' behind a beam to the next corner it goes with the speed of travel; behind the last one it ends.
Function RlRound(p As Integer, bit1 As Integer, bit2 As Integer, turn As Double, deeper As Double) As Boolean
  Integer side, k, bit, free, before, entry, leaving
  Boolean good
  String text$, place1$, place2$, place3$
  RlRound = False
  SpeedS RL_CROSSING_MM_S
  rl_even = 1
  rl_z = CZ(RealPos)
  rl_u = CU(RealPos)
  rl_x = Int(CX(RealPos) * 1000 + 0.5)
  rl_y = Int(CY(RealPos) * 1000 + 0.5)
  text$ = "ROUND," + Str$(rl_proof) + "," + Str$(Tool) + "," + Str$(Motor) + "," + Str$(Power)
  text$ = text$ + "," + RlNumber$(SpeedS(1)) + "," + Str$(RlBraking()) + "," + Str$(rl_x) + "," + Str$(rl_y)
  text$ = text$ + "," + RlNumber$(rl_z) + "," + RlNumber$(rl_u)
  If RlSixAxes() Then
    text$ = text$ + "," + RlNumber$(CV(RealPos)) + "," + RlNumber$(CW(RealPos))
  Else
    text$ = text$ + ",0,0"
  EndIf
  good = True
  side = 0
  Do While good And side < 4
    bit = bit1
    free = rl_free1
    If side = 1 Or side = 3 Then
      bit = bit2
      free = rl_free2
    EndIf
    k = p + ((side + 1) Mod 4)
    good = False
    entry = 0
    leaving = 0
    place1$ = ",0,0"
    place2$ = ",0,0"
    place3$ = ""
    If Abs(SpeedS(1) - RL_CROSSING_MM_S) > 0.001 Then
      rl_even = 0
    EndIf
    before = Sw(bit)
    If before = free And rl_even = 1 Then
      entry = RlEdge(k, turn, deeper, bit, 1 - free)
      place1$ = RlPlace$()
      If entry = 3 - free Then
        leaving = RlEdge(k, turn, deeper, bit, free)
        place2$ = RlPlace$()
        If leaving = 2 + free Then
          good = True
          If side < 3 Then
            SpeedS RL_TRAVEL_MM_S
            Move P(k) -Z(deeper) +U(turn)
            SpeedS RL_CROSSING_MM_S
            place3$ = RlPlace$()
          EndIf
        EndIf
      EndIf
    EndIf
    text$ = text$ + "," + Str$(before) + Str$(entry) + Str$(leaving) + place1$ + place2$ + place3$
    side = side + 1
  Loop
  If rl_even = 0 Then
    rl_code$ = "not_ready"
    Exit Function
  EndIf
  If RlAsk(text$) Then
    If rl_word$ = "OK" And good Then
      RlRound = True
    EndIf
  EndIf
Fend

' Drives towards a corner until an input shows a level; gives what it shows at rest, and 2 more if
' that is what ended the way.
Function RlEdge(k As Integer, turn As Double, deeper As Double, bit As Integer, level As Integer) As Integer
  Integer shown
  If level = 1 Then
    Move P(k) -Z(deeper) +U(turn) Till Sw(bit) = On
  Else
    Move P(k) -Z(deeper) +U(turn) Till Sw(bit) = Off
  EndIf
  ' Such a movement ends before the arm is quite at rest.
  Wait 0.02
  shown = 0
  If TillOn Then
    shown = 2
  EndIf
  RlEdge = shown + Sw(bit)
Fend

' Gives where the robot is, from the first corner; notes whether it is still level.
Function RlPlace$ As String
  Long dx, dy
  Double turned
  dx = Int(CX(RealPos) * 1000 + 0.5)
  dy = Int(CY(RealPos) * 1000 + 0.5)
  dx = dx - rl_x
  dy = dy - rl_y
  turned = Abs(CU(RealPos) - rl_u)
  If turned > 180 Then
    turned = Abs(turned - 360)
  EndIf
  If Abs(CZ(RealPos) - rl_z) > 0.02 Or turned > 0.01 Then
    rl_even = 0
  EndIf
  RlPlace$ = "," + Str$(dx) + "," + Str$(dy)
Fend

' Gives the lesser of acceleration and deceleration of straight movements, whole mm/s2.
Function RlBraking As Long
  Double least
  least = AccelS(1)
  If AccelS(2) < least Then
    least = AccelS(2)
  EndIf
  RlBraking = Int(least)
Fend
