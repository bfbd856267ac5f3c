"""Root stress and strength of teeth."""
