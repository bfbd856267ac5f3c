"""Scores of predictions: metrics with intervals, conditions, detection limits."""
