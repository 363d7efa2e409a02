"""Worlds and their parts as files have them: scenes, maps, robots, recorded episodes."""
