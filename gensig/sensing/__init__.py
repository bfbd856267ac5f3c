"""From bearing accelerations to recorded channels: filters, gain, noise."""
