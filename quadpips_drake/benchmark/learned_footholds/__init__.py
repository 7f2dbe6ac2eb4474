"""Data for the network of footholds, and a picture of its training."""
