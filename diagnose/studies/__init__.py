"""Studies: every protocol, seed, control and baseline, and the numbers that come of them."""
