"""The stage (PyVista offscreen), shaders, colour, plots, sheets of pictures."""
