"""A command line of the tests' own, apart from the tester's passwords and settings."""

import os
import sys

import click
import pytest
from robolink_cli import _lazy, _render
from robolink_cli._context import controller_options, json_option


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    for name in [name for name in os.environ if name.startswith(("ROBOLINK", "_ROBOLINK"))]:
        monkeypatch.delenv(name)
    monkeypatch.setitem(sys.modules, "keyring", None)


@pytest.fixture
def command(monkeypatch):
    """Put a command of the test's own in place of ``status``, and one for ``sim``."""
    seen = []

    def install(act=lambda context: None):
        @click.command("status")
        @controller_options
        def status(context):
            seen.append(context)
            return act(context)

        @click.command("sim")
        @json_option
        def sim():
            _render.say("serving")

        own = {"status": status, "sim": sim}
        monkeypatch.setattr(
            _lazy.LazyGroup, "get_command", lambda self, context, name: own.get(name)
        )
        return seen

    return install
