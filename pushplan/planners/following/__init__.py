"""Policies that follow the plans of a planner and plan again."""
