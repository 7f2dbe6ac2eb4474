"""Constants of nature, one copy of each."""

GRAVITY = 9.81
"""Acceleration of free fall [m/s^2], along -z of W; Drake's default too."""
