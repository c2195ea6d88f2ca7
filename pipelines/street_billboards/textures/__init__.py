"""What billboards look like from each side, made small."""
