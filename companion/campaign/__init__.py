"""Campaigns: many simulated flights with swept configuration keys, on many processes.

campaign_file, swept, loading  the YAML file, its swept keys, and what it names
campaign, design, case, keys   the cases: points of the grid, samples, configuration of each
flight, outcomes, kinematics   flies one case (kind: flights, or batch); returns its row of results
unit, engine, cluster          units of work on Dask's workers
running, estimate              `companion campaign FILE`: checks, estimates, runs, says how to go on
folder, store, versions        the folder: description, lock, results, versions that must be equal
rerun                          one case again, fully recorded
report, tune                   the page; the search of limits, gains and weights
"""
