"""Modules that are imported when they are needed, and objects that a text names."""
