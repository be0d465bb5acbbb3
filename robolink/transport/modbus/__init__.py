"""Modbus over TCP and serial lines, and the PLC mailbox on it."""
