"""Methods that integrate the equations of motion; ``registry`` lists them."""
