"""Campaigns: many simulated flights with swept configuration keys, on many processes.

campaign_file, swept, loading  read the YAML file, its swept keys, and the files that it names
campaign, design, case, keys   make the cases: points of the grid, samples, configurations
flight, outcomes, kinematics   fly one case (kind: flights, or batch), and make its row of results
unit, engine, cluster          run the cases in units of work on Dask's workers
running, estimate              `companion campaign FILE`: checks, estimates and runs a campaign
folder, store, versions        the campaign's folder: description, lock, results, versions
rerun                          flies one case again, fully recorded
report, tune                   write the HTML page; search limits, gains and weights
"""
