"""All that this program knows of ArduPilot's copter."""
