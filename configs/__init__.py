"""Hydra configuration, installed as the package gensig.configs: data only."""
