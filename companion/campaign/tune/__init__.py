"""Search of limits, gains and weights over the cases of a campaign.

first_flight  two flights that measure the vehicle before the search
candidates  the values that are searched, and the candidates with which the search starts
scores      the errors of a candidate's flights, and the best candidates so far
search      the search itself, with Optuna; it can be interrupted and continued
certainty   the comparison with the unchanged configuration on cases that the search has not seen
writing     the result as YAML with its reasons
command     `companion campaign tune`
"""
