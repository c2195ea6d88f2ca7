"""A gonioreflectometer, and cloths made of yarns to lay on it."""
