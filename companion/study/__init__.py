"""The paper's experiments and further ones: figures, tables, and one page with all results.

The studies fly the planners of `companion.attitude`, the same code that flies a vehicle. They need
the extra `study`, and `nmpc` and `track` also the extra `nmpc`. `registry` lists the studies and
checks that their extras are installed.
"""
