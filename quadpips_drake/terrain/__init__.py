"""Terrain: its description, the library, files in and out, the builder into a plant, exact ground truth."""
