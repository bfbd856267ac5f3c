"""Maps of how well a fault can be told, over speed and torque."""
