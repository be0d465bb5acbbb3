"""Every small fault of the wire, each in a whole calibration."""
