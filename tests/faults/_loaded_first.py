"""The modules that the fork server loads, so that no forked process loads them anew.

Packages of the library load their parts on demand, so each part is named or found.
"""
# ruff: noqa: F401 - loading them is all that is wanted

import encodings.ascii
import encodings.idna
import getpass
import importlib
import pkgutil

import _pytest.config  # the main module of a test run imports it, in each fork anew
import rich.console
import rich.table
import robolink_cli.commands.controller.jog
import robolink_cli.commands.measure.calibrate
import robolink_cli.commands.record.recover
import robolink_cli.main
import robolink_cli.session.motion_consent
import robolink_cli.stopping.notes
import robolink_simulators.cell.clock
import robolink_simulators.control.assist

import robolink.config.passwords
import robolink.controllers
import robolink.journal
import robolink.stopping
import robolink.transaction
import robolink.transport.modbus.frames
import robolink.transport.modbus.opening
import robolink.transport.tcp

_ALL_OF = (
    robolink.controllers,
    robolink.journal,
    robolink.stopping,
    robolink_cli.commands.measure.calibrate,
)

for _package in _ALL_OF:
    for _module in pkgutil.walk_packages(_package.__path__, f"{_package.__name__}."):
        importlib.import_module(_module.name)
