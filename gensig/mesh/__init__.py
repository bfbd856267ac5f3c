"""The quasi-static gear mesh: compliances, contact, load sharing, stiffness."""
