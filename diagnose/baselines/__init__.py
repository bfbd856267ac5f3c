"""Baselines that a network must beat, and the features they use."""
