"""Where a drive's photographs were taken: given, mended, adjusted, or found."""
