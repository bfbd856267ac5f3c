"""What the teeth are: involute, root curve, line of action. No elasticity, no time."""
