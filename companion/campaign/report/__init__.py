"""The report of a campaign: one HTML page, and its results as one table in Parquet and CSV.

page         `companion campaign report`: writes the page and the tables
results      what a campaign has found so far
statistics   success rates with intervals, levels of a factor, worst cases, the Pareto front
sensitivity  which factor the outcomes depend on
tables, plots  what the page shows
"""
