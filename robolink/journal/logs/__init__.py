"""The journal as the driver of one controller uses it: writing, looking, or only glancing."""
