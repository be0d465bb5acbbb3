"""The files of makers and programs, each by what nothing else begins with."""
