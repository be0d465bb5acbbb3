"""The files of makers and programs, each recognised by its own beginning."""
