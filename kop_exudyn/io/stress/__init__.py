"""Tools that try to break the reading and writing of files: damaged copies of every kind, and killed processes."""
