"""Trained networks on recordings and data sets: predict, evaluate, export."""
