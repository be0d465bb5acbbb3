"""A stand-in for the process of a job: it speaks the contract, as it is told by its arguments."""

import json
import os
import socket
import sys
import time

VIEW = {
    "number": 1,
    "waits": True,
    "head": {
        "cell": "line3",
        "job": "change",
        "title": "Ready?",
        "step": None,
        "simulated": True,
        "needle": "",
    },
    "status": None,
    "body": {"kind": "question", "told": [], "question": "Ready?", "text": False},
    "actions": [],
    "heard": [],
    "message": "",
}


def main():
    line = socket.socket(fileno=int(sys.argv[1]))
    said = os.environ["STAND_IN"]
    talk = line.makefile("rwb")

    def send(document):
        talk.write(json.dumps(document).encode() + b"\n")
        talk.flush()

    if said == "dies":
        sys.exit("the stand-in fell over")
    if said == "giant":
        talk.write(b'{"t":"told","text":"' + b"x" * 200_000 + b'"}\n')
        talk.flush()
    if said == "nonsense":
        talk.write(b"\xff\x00 no JSON\n")
        talk.flush()
    if said == "foreign":
        send({"t": "view", "view": {**VIEW, "colour": "red"}})
    send({"t": "view", "view": VIEW})
    if said == "deaf":
        time.sleep(30)
    for raw in talk:
        heard = json.loads(raw)
        if heard["t"] == "leave":
            send({"t": "left", "code": 9, "kept": ["Nothing was sent."]})
            return
        send({"t": "told", "text": json.dumps(heard)})
    with open(os.environ["STAND_IN_END"], "w") as file:
        file.write("the line ended")


main()
