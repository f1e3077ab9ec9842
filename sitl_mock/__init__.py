"""A mock multirotor with an autopilot that speaks MAVLink, to test programs that fly one."""
