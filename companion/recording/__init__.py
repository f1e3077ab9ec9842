"""Recording of a flight, and the measurements computed from it afterwards.

recorder, background_file  writes `flight.mcap`, whose channels are in `mcap_file`
tlog                       writes `flight.tlog`
trace, series              collects rows in flight, from which the measurements are computed
flight_record, export      reads a recorded flight; writes it as CSV or Parquet
measurements               measurements of a flight, and whether they are within their limits
summary_tables             the measurements as tables at the end of a flight
closing_words, what_to_do  the result of a flight in words, and advice after an early end
folder, learned_file       makes the folder of a flight; stores learned drag for later flights
"""
