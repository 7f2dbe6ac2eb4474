"""Footholds that imitate our own foothold search: data from offline queries, a small network, its files."""
