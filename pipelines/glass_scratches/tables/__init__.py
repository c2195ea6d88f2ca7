"""What a scratch's cross-section does to light."""
