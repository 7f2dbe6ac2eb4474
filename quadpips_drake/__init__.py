"""A quadruped that sees rough ground, decides where to step and walks there, as one Drake diagram."""

__version__ = "0.1.0"
