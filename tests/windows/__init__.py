"""robolink's wheel on a Windows CPython under wine: ``make windows``."""
