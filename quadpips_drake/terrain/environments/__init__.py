"""The environments that come with the package: a file each, or one for a family. `library.py` gives them their names."""
