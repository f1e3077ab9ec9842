"""Inject a fault in flight and see what follows: the GPS fix is lost in a hover.

Program and mock vehicle run in this process, on the vehicle's own clock: a flight takes a second or
two, opens no socket, and is the same to the bit each time. docs/mock-vehicle.md lists the faults,
docs/safety.md the effect of each fault.

Run: python examples/inject_fault.py
"""

from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, fly

PX4 = shipped("mock-px4.yaml")
vehicle = MockVehicle(config=PX4)
vehicle.inject({"kind": "gps_loss", "after_offboard_s": 4.0, "duration_s": 3.0})
hover = {"flight": {"maneuvers": ["hover"]}, "hover": {"duration_s": 10.0}}
summary = fly(changed(load(PX4), hover, "a hover"), vehicle)

for time, text in summary.events:
    print(f"{time:6.2f} s  {text}")
print(f"result: {summary.result}")
state = vehicle.state()
place = ", ".join(f"{value:.2f}" for value in state["position"])
print(f"true state: {state['mode']}, armed: {state['armed']}, at ({place}) m NED")
