"""Identify a vehicle from a recorded flight: lag and dead time of each axis, and the thrust map.

Any `.tlog` will do in which the autopilot followed commanded body rates; doublets fit best.
`companion identify --log FOLDER` does the same and writes a file for your configuration.

Run: python examples/identify_from_log.py [FOLDER]
"""

from recorded import flight_folder

from companion.identification import identify_vehicle
from companion.vehicle.flight_log import read_flight_log

log = read_flight_log(flight_folder() / "flight.tlog")
print(f"{len(log.setpoints)} setpoints were followed, {len(log.rates)} body rates were measured")
vehicle = identify_vehicle(log.setpoints, log.rates, log.specific_thrust)
for axis, response in vehicle.axes.items():
    nearer = response.second_order
    print(
        f"{axis:<5} lag {1e3 * response.lag:5.1f} ms, dead time {1e3 * response.dead_time:5.1f} ms,"
        f" misfit {response.fit.misfit:.0%}: {response.flaw() or 'a good fit'} of first order"
        + (f"; nearer: {nearer.described}" if nearer is not None else "")
    )
if vehicle.thrust is not None:
    print(f"thrust: {vehicle.thrust.described()}; hovers at {vehicle.thrust.normalised(9.81):.3f}")
