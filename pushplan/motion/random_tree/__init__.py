"""Random trees of drivable arcs, grown by OMPL."""
