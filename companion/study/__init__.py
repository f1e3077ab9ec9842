"""The paper's experiments, and a user's own: responses, figures, tables and one page.

Everything here flies the planners of `companion.attitude` as they fly a vehicle; nothing is a copy
of a law. The room needs the extra `study`; `companion.study.needs` says so before it is imported.
"""
