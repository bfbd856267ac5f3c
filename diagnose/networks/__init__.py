"""Networks: vibration in, class scores out; calibration, domain and adaptation of trained ones."""
