"""Hosts that carry a simulated device: in this process, on a port, a serial cable, a CAN bus."""
