"""Codec + transport + semantics = a machine that can be used."""

from robolink.controllers._connect import connect as connect
