"""A pelt of hairs, photographed from above, whose depths are known."""
