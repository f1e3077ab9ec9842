"""Studies: experiments of the paper and our own, with figures, tables, and a page of results.

The studies fly the planners of `companion.attitude`, the same code that flies a vehicle. All
studies need the extra `study`; `nmpc` and `track` also need the extra `nmpc`. `registry` lists the
studies and checks that their extras are installed.
"""
