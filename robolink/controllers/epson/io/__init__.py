"""Bits, variables, alarms and typed statements of an EPSON controller."""
