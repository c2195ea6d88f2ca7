"""How far each direction is from the edge of what a vertex sees."""
