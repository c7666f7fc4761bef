"""Light: the lobes of sun and sky, the ground's merged ones, what they see of each other, and the truth beside them."""
