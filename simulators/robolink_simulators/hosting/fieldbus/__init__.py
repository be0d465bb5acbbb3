"""Hosts for field buses: Modbus servers and CANopen nodes."""
