"""Recording of a flight, and the measurements computed from it afterwards.

recorder, background_file  writes `flight.mcap`, whose channels are in `mcap_file`
tlog                       writes `flight.tlog`
trace, series              rows for the figures, kept in flight
flight_record, export      reads a recorded flight; writes it as CSV or Parquet
measurements               figures of a flight, and whether it was good
summary_tables             the figures as tables at the end of a flight
closing_words, what_to_do  the same in words, and the advice
folder, learned_file       the folder of a flight, and what flights learned beside it
"""
