"""A multirotor with an autopilot that speaks MAVLink: the judge of programs that fly one."""
