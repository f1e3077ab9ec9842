"""Watching a flight, and changing its limits, gains and weights while it flies.

A helper process does the work: it watches the edited file, and serves the live page and the live
stream. The flight sends it events and takes changes from it, over a channel that never blocks.
"""
