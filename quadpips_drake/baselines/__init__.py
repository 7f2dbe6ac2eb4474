"""Rivals: other planners, each through the same contract."""
