"""Scenes on engines, each run scored against PIC: the report of `carom run`."""
