"""Tools that try to break the rest: seeded random structures, interrupted runs, and judges that trust nobody."""
