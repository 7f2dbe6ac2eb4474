"""Terrains from files and into them: our YAML, the authors' JSON, meshes."""
