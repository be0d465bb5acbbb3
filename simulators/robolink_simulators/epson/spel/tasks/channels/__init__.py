"""What Print #, Input # and their kin reach: ports, files, the window of a person."""
