"""The paper's experiments and our own: responses, figures, tables, and one page with all of them.

The studies fly the planners of `companion.attitude`, the same code that flies a vehicle. They need
the extra `study`; `registry` lists them and checks that the extra is installed.
"""
