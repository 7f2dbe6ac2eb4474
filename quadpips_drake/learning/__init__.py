"""Steppability: data factory, network, training, evaluation, and the system that runs the network."""
