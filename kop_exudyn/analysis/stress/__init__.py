"""Tools that try to break the rest: seeded random structures, mutated files, and judges that trust nobody."""
