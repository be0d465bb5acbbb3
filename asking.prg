
Function main
  SetNet #201, "127.0.0.1", 5001, CRLF
  OpenNet #201 As Client
  WaitNet #201
  Print #201, "a line with a wrong sum"
  Wait 1
  Print ChkNet(201)
Fend
