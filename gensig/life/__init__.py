"""What gears suffer over their lives: root stress, wear, growing cracks and pits."""
