"""Watching a flight and changing its limits, gains and weights meanwhile.

The helper process does the work: it watches the edited file and serves the live page. The flight
sends it what happens and takes changes from it, over a channel that never blocks.
"""
