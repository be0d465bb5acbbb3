"""CAN and CANopen: the bus, SDO transfers, a watched node, and the PLC mailbox on it."""
