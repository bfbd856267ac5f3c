"""Printed and reference figures as data."""
