"""Runs: started, written as they go, resumed, repeated, and planned."""
