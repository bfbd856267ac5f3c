"""Life of gears: root stress, wear, growing cracks and pits."""
