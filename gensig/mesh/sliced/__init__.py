"""Gear meshes cut into slices over the face width: helical pairs and part-width faults."""
