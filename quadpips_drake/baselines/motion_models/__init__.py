"""Learned motion models of a walk that takes velocity commands, and planning over such commands with them.

O. Taouil, G. Turrisi, D. Schleich, V. Barasuol, C. Semini, S. Behnke, "Quadrupedal Footstep Planning using Learned Motion
Models of a Black-Box Controller" (2023). Nothing here but ``walk_settings`` knows how the walk is made.
"""
