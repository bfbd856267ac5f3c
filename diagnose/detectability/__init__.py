"""Detectability of a fault: maps over speed and torque."""
