"""Networks: vibration in, class scores out; calibration and domain of trained ones."""
