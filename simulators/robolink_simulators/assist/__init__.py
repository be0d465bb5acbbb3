"""The assist port: the hands, eyes and truth of a served simulator."""
