"""The functions of a Windows console that wine's lacks; runs on the Windows Python itself.

    python -m _windows_console WAY PORT ARGUMENTS...

runs ``robolink`` in the console that wine has opened. Keys come over the socket, one name a line,
and go into the console's own queue, as the records that Windows makes of them: with ``sequences``
one for each character where the program has asked for escape sequences, else with the code of the
key. With ``sequences`` what the program writes goes to the far end, which obeys the sequences;
where the program has not asked for that, an ESC is an arrow there, as on Windows. With ``calls``
the console says that it has no such mode, as cmd.exe in legacy mode does, and wine draws.

Evidence: SetConsoleMode and "High-level console modes" of Microsoft's documents for what the modes
do; closing a window runs the handlers in a thread of their own and ends the process when they have
returned, after 5 s at the latest ("HandlerRoutine").
"""

import ctypes
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterable
from ctypes import wintypes
from importlib import import_module
from pathlib import Path
from typing import Any

kernel32: Any = ctypes.WinDLL("kernel32")  # type: ignore[attr-defined,unused-ignore]
kernelbase: Any = ctypes.WinDLL("kernelbase")  # type: ignore[attr-defined,unused-ignore]
kernel32.GetStdHandle.restype = wintypes.HANDLE
kernel32.CreateThread.restype = wintypes.HANDLE
kernel32.GetCurrentProcess.restype = wintypes.HANDLE

_INPUT, _OUTPUT = -10, -11
_PROCESSED_INPUT, _SEQUENCES_IN, _SEQUENCES_OUT = 0x1, 0x200, 0x4
_CLOSE_EVENT, _CLOSE_WAIT_MS = 2, 5000
_LEFT_CTRL = 0x8

_CODES = {
    "left": 37,
    "up": 38,
    "right": 39,
    "down": 40,
    "pageup": 33,
    "pagedown": 34,
    "end": 35,
    "home": 36,
    "insert": 45,
    "delete": 46,
    "f2": 113,
}
_CHARACTERS = {"escape": (27, "\x1b"), "enter": (13, "\r"), "backspace": (8, "\b")}
_WITH_SEQUENCES = {
    "left": "\x1b[D",
    "up": "\x1b[A",
    "right": "\x1b[C",
    "down": "\x1b[B",
    "pageup": "\x1b[5~",
    "pagedown": "\x1b[6~",
    "end": "\x1b[F",
    "home": "\x1b[H",
    "insert": "\x1b[2~",
    "delete": "\x1b[3~",
    "f2": "\x1bOQ",
    "escape": "\x1b",
    "enter": "\r",
    "backspace": "\x7f",
    "ctrl-c": "\x03",
}


def mode(handle: Any) -> int:
    """Return the mode of an end of the console."""
    found = wintypes.DWORD()
    kernel32.GetConsoleMode(handle, ctypes.byref(found))
    return found.value


def write_keys(*records: tuple[bool, int, str, int]) -> None:
    """Put key records (down, code, character, control keys) into the console's queue."""
    packed = b"".join(
        struct.pack("<HxxiHHHHI", 1, down, 1, code, 0, ord(character or "\0"), control)
        for down, code, character, control in records
    )
    done = wintypes.DWORD()
    handle = wintypes.HANDLE(kernel32.GetStdHandle(_INPUT))
    if not kernel32.WriteConsoleInputW(handle, packed, len(records), ctypes.byref(done)):
        raise ctypes.WinError()  # type: ignore[attr-defined,unused-ignore]


def press(name: str, *, released: bool) -> None:
    """Do what the console does with a key that is pressed and, usually, released again."""
    asked = mode(wintypes.HANDLE(kernel32.GetStdHandle(_INPUT)))
    if name == "ctrl-c" and asked & _PROCESSED_INPUT:
        kernel32.GenerateConsoleCtrlEvent(0, 0)
    elif asked & _SEQUENCES_IN:
        write_keys(*((True, 0, one, 0) for one in _WITH_SEQUENCES.get(name, name)))
    else:
        code, character = _CHARACTERS.get(name, (_CODES.get(name, 0), ""))
        control = 0
        if name == "ctrl-c":
            code, character, control = 67, "\x03", _LEFT_CTRL
        elif not code:
            code, character = ord(name.upper()) & 0xFF if name.isalnum() else 0, name
        downs = [(True, code, character, control)]
        write_keys(*downs, *([(False, code, character, control)] if released else []))


def close_window() -> None:
    """End this process as Windows does when its window is closed."""
    routine = ctypes.cast(kernelbase.CtrlRoutine, ctypes.c_void_p)
    thread = kernel32.CreateThread(None, 0, routine, ctypes.c_void_p(_CLOSE_EVENT), 0, None)
    kernel32.WaitForSingleObject(wintypes.HANDLE(thread), _CLOSE_WAIT_MS)
    kernel32.TerminateProcess(wintypes.HANDLE(kernel32.GetCurrentProcess()), 0xC000013A)


def longest_gap_s(keys: Iterable[str], pause_s: float) -> float:
    """Press keys one after another; return the longest time between two of them.

    A busy computer stretches it, unlike the keys of a real scanner.
    """
    longest_s = 0.0
    before_s: float | None = None
    for one in keys:
        press(one, released=True)
        now_s = time.monotonic()
        longest_s, before_s = max(longest_s, now_s - (before_s or now_s)), now_s
        time.sleep(pause_s)
    return longest_s


def tell(gap_s: float) -> None:
    """Leave a number for the far end, which reads the file once it is complete."""
    part = Path("gap.part")
    part.write_text(str(gap_s), encoding="utf-8")
    part.replace("gap.txt")


def hand(connection: socket.socket) -> None:
    """Press the keys that the far end names."""
    for line in connection.makefile(encoding="utf-8"):
        name = line.rstrip("\n")
        if name == "close":
            close_window()
        elif name == "kill":
            kernel32.TerminateProcess(wintypes.HANDLE(kernel32.GetCurrentProcess()), 1)
        elif name.startswith("burst "):
            tell(longest_gap_s(name.removeprefix("burst ").split("+"), 0.0))
        elif name.startswith("scan "):
            tell(longest_gap_s(name.removeprefix("scan "), 0.008))
        elif name.startswith("held "):
            press(name.removeprefix("held "), released=False)
        else:
            press(name, released=True)


_Writer: Any = ctypes.WINFUNCTYPE(  # type: ignore[attr-defined,unused-ignore]
    *(wintypes.BOOL, wintypes.HANDLE, ctypes.c_void_p, wintypes.DWORD),
    *(ctypes.POINTER(wintypes.DWORD), ctypes.c_void_p),
)


def write_to(connection: socket.socket) -> Any:
    """Send the far end everything that this process writes to its console."""

    def written(handle: int, text: int, count: int, done: Any, _: int) -> int:
        shown = ctypes.wstring_at(text, count).replace("\r\n", "\n").replace("\n", "\r\n")
        if not mode(wintypes.HANDLE(handle)) & _SEQUENCES_OUT:
            shown = shown.replace("\x1b", "\u2190")
        connection.sendall(shown.encode("utf-8", "replace"))
        if done:
            done[0] = count
        return 1

    writer = _Writer(written)
    target = ctypes.cast(kernelbase.WriteConsoleW, ctypes.c_void_p).value
    address = ctypes.cast(writer, ctypes.c_void_p).value
    assert target is not None
    jump = b"\xff\x25\0\0\0\0" + struct.pack("<Q", address)  # jmp to where the next 8 bytes say
    before = wintypes.DWORD()
    kernel32.VirtualProtect(ctypes.c_void_p(target), len(jump), 0x40, ctypes.byref(before))
    ctypes.memmove(target, jump, len(jump))
    return writer


def without_sequences() -> None:
    """Make the console report that it neither obeys escape sequences nor makes them from keys."""
    keys: Any = import_module("prompt_toolkit.input.win32")
    screen: Any = import_module("prompt_toolkit.output.windows10")
    screen.is_win_vt100_enabled = lambda: False
    keys._is_win_vt100_input_enabled = lambda: False


def begin_reading() -> None:
    """Make wine's console read its terminal, which it does only after a first look at a record.

    Before that ``GetNumberOfConsoleInputEvents``, and with it ``kbhit``, report no key.
    """
    record, found = ctypes.create_string_buffer(20), wintypes.DWORD()
    handle = wintypes.HANDLE(kernel32.GetStdHandle(_INPUT))
    kernel32.PeekConsoleInputW(handle, record, 1, ctypes.byref(found))


def main(way: str, port: str, *arguments: str) -> None:
    """Run robolink in this console."""
    connection = socket.create_connection(("127.0.0.1", int(port)))
    if way == "sequences":
        sys.kept_writer = write_to(connection)  # type: ignore[attr-defined]
    else:
        without_sequences()
    begin_reading()
    threading.Thread(target=hand, args=(connection,), daemon=True).start()
    sys.argv[1:] = arguments
    from robolink_cli.entry import main as robolink

    robolink()


if __name__ == "__main__":
    main(*sys.argv[1:])
