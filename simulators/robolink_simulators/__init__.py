"""Simulated controllers and the world around them. Everything here is SIMULATED.

A device knows no sockets and no clock: it is given bytes and the time, and says when it will
next do something by itself. Hosts (:mod:`robolink_simulators.hosting`) bring both.
"""
