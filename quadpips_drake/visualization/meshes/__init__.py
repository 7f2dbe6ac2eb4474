"""Meshes of more than plans: ground and arrows."""
