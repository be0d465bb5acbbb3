"""The wizard as a full screen, drawn by prompt_toolkit.

Only here is that package imported. A screen is a text of 24 rows; what differs is drawn anew.
"""

import asyncio
import os
import sys
import time
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from prompt_toolkit.application import Application
from prompt_toolkit.input import Input, create_input
from prompt_toolkit.input.typeahead import clear_typeahead
from prompt_toolkit.key_binding import KeyBindings, KeyPress, KeyPressEvent
from prompt_toolkit.keys import Keys
from prompt_toolkit.layout import FormattedTextControl, Layout, Window
from prompt_toolkit.output import Output, create_output

from robolink.interrupts import EndedBy, ended_by
from robolink_cli.console.output import visible
from robolink_cli.prompts.lines import open_lines
from robolink_cli.wizard.ending import ended_of
from robolink_cli.wizard.faces.arrivals import TimedKeys, TimedPress, timed
from robolink_cli.wizard.faces.lines import LineFace, carry_out, leaves
from robolink_cli.wizard.flow import advance, armed_anew, stops_at_once
from robolink_cli.wizard.happenings import Happening, HasEnded, KeyPressed, TooFast
from robolink_cli.wizard.keys import CountedKey, KeyGate, name_of
from robolink_cli.wizard.screens.layout import HEIGHT, WIDTH
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.work import Desk

if TYPE_CHECKING:
    from robolink_cli.wizard.work import Work

_TURN_S: Final = 0.03
_REPAINT_S: Final = 0.4
"""Interval in seconds at which the age of the reading is redrawn while nothing happens."""


class FullFace:
    """Shows a desk on the whole terminal; as lines while the window is too small.

    Args:
        source: Where keys come from, ``None`` for this process's terminal.
        output: Where it is drawn, ``None`` for stderr.
    """

    def __init__(self, source: Input | None = None, output: Output | None = None) -> None:
        self._input = timed(create_input(sys.stdin) if source is None else source)
        self._output = create_output(stdout=sys.stderr) if output is None else output
        self._gate = KeyGate()
        self._painted_s = 0.0
        self._left = False

    def run(self, desk: Desk, state: WizardState, work: "Work[Any]") -> WizardState:
        """Show it until the work has ended; return the last state."""
        self._desk, self._state, self._work = desk, state, work
        self._left = False
        begins_with_lines = not self._has_room()
        while begins_with_lines or self._draws():
            begins_with_lines = False
            lines = LineFace(self._has_room)
            self._state = lines.run(desk, self._state, work)
            if not lines.handed_back:
                break
            self._gate = KeyGate()
            self._state = armed_anew(self._state, time.monotonic())
        return self._state

    def _draws(self) -> bool:
        """Draw until the work has ended; return whether it goes on and the window is too small."""
        application: Application[bool] = Application(
            layout=Layout(Window(FormattedTextControl(self._text, show_cursor=False))),
            key_bindings=self._bindings(),
            full_screen=True,
            input=self._input,
            output=self._output,
        )
        application.ttimeoutlen = 0.05

        def begin() -> None:
            application.create_background_task(self._turn(application))

        # The command's signal handlers stay: they reach the work, which then ends in order.
        narrow = application.run(pre_run=begin, handle_sigint=False)
        self._forget_keys()
        return narrow

    def _has_room(self) -> bool:
        """Return whether a screen fits into the window."""
        size = self._output.get_size()
        return size.columns >= WIDTH and size.rows >= HEIGHT

    async def _turn(self, application: "Application[bool]") -> None:
        """Handle events, until the work has ended or the window is too small."""
        while True:
            ended, now_s = self._work.ended, time.monotonic()
            happened: list[Happening] = [*self._desk.happened()]
            happened += self._alone(now_s)
            for one in happened:
                self._happens(one)
            if happened or now_s - self._painted_s > _REPAINT_S:
                self._painted_s = now_s
                application.invalidate()
            narrow = not self._has_room()
            if narrow or (ended and not self._shows_the_end()):
                application.exit(result=not ended)
                return
            await asyncio.sleep(_TURN_S)

    def _alone(self, now_s: float) -> list[Happening]:
        """Return what is known of keys because nothing followed them."""
        quiet_s = self._input.quiet() if isinstance(self._input, TimedKeys) else now_s
        if quiet_s is None:
            return []
        found: list[Happening] = [self._pressed(one) for one in self._gate.due(quiet_s)]
        return [*found, TooFast()] if self._gate.burst_ended(quiet_s) else found

    def _shows_the_end(self) -> bool:
        """Show how the work ended, if there is a screen for it, until a person leaves it."""
        if ended_by() is EndedBy.HUNG_UP:
            return False  # nobody is there to close it
        if self._state.ended is None:
            ended = ended_of(self._state, self._work.error, time.monotonic())
            if ended is None:
                return False
            self._happens(HasEnded(ended))
            self._painted_s = 0.0
        return not self._left

    def _bindings(self) -> KeyBindings:
        bindings = KeyBindings()

        def pressed(event: KeyPressEvent) -> None:
            press = event.key_sequence[0]
            key = getattr(press.key, "value", press.key)
            self._press(str(key), press)

        bindings.add("<any>", eager=True)(pressed)
        bindings.add("escape", eager=True)(pressed)
        bindings.add("<bracketed-paste>", eager=True)(
            lambda event: self._pasted(event.key_sequence[0])
        )
        return bindings

    def _press(self, key: str, press: KeyPress) -> None:
        data, (at_s, quiet_s) = press.data, _when(press)
        if self._state.has_field and _writes(key):
            # A field accepts bursts: scanners fill it in.
            text = data if data.isprintable() and name_of(key) not in ("enter", "backspace") else ""
            if self._fills(key, text):
                self._happens(KeyPressed(name_of(key), text, at_s))
                return
        stops = stops_at_once(self._state, name_of(key))
        for one in self._gate.press(key, at_s, quiet_s, stops=stops):
            self._happens(self._pressed(one))

    def _pasted(self, press: KeyPress) -> None:
        """Handle input that came at once: a line into a field, as a Windows console passes a scan.

        prompt_toolkit makes a paste of keys that its reader finds in one look, ENTER among them.
        """
        line, ends, more = press.data.replace("\r", "\n").partition("\n")
        if not self._state.has_field or self._state.writing is not None or more.strip("\n"):
            # A key just before it is the start of the same burst.
            for one in self._gate.burst(*_when(press)):
                self._happens(self._pressed(one))
            return
        for key in line:
            self._press(key, KeyPress(key))
        if ends:
            self._press(Keys.ControlM.value, KeyPress(Keys.ControlM))

    def _fills(self, key: str, text: str) -> bool:
        """Return whether a key goes into the field at once; writing keys go through the gate."""
        if self._state.writing is None:
            return True
        return text.isdigit() or name_of(key) == "backspace"

    def _pressed(self, one: CountedKey) -> KeyPressed:
        return KeyPressed(name_of(one.key), one.key if len(one.key) == 1 else "", one.at_s)

    def _happens(self, happening: Happening) -> None:
        self._state, effects = advance(self._state, happening)
        carry_out(self._desk, effects)
        self._left |= leaves(effects)

    def _text(self) -> str:
        rows = screen_of(self._state, time.monotonic()).rows()
        return "\n".join(visible(row) for row in rows)

    def _forget_keys(self) -> None:
        """Discard keys still held down: they are not for the shell."""
        clear_typeahead(self._input)
        if os.name == "nt":
            open_lines().forget(0.0)
            return
        with suppress(ImportError, OSError, ValueError, AttributeError):
            termios: Any = import_module("termios")
            with suppress(termios.error):
                termios.tcflush(self._input.fileno(), termios.TCIFLUSH)


def _when(press: KeyPress) -> tuple[float, float | None]:
    """Return the latest time at which a key came, and the earliest possible, if known."""
    if isinstance(press, TimedPress):
        return press.at_s, press.quiet_s
    return time.monotonic(), None


def _writes(key: str) -> bool:
    """Return whether a key is a character, or ends or shortens what is in a field."""
    return len(key) == 1 or name_of(key) in ("enter", "backspace")
