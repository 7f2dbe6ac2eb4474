"""Typed configuration: dataclasses in code whose numbers have ranges, overlaid by YAML files and ``key=value`` overrides."""
