"""Kernels in C: rods' assembly, factorisation, rotations. Compiled at installation or, from a
checkout, at first use; loaded through ctypes, so that no Python headers are needed.

Where no compiler is at hand, every kernel has a NumPy form beside its caller, which tests hold
against the compiled one.
"""
