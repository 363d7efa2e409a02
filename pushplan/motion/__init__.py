"""A robot's motion: footprints, curves of bounded curvature, shortcutting, speed profiles."""
