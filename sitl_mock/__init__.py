"""A mock multirotor with a MAVLink autopilot, to test programs that fly a multirotor."""
