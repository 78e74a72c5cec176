"""Scenes: the built-in ones, files and changes, the ring that follows from the ground, and what is told of mistakes."""
