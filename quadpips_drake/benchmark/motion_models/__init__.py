"""Walks for motion models: data to learn from, and held-out ones to judge by."""
