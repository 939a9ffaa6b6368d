"""One rod: rotations and rigid motions, cross-sections and materials, the element."""
