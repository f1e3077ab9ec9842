"""Why control or a setpoint is refused, in words for the client."""

FLIGHT_ENDING = "control is ending and the vehicle is held; request control again when it has ended"
SETPOINTS_FORGOTTEN = (
    "too many programs send setpoints, and yours were forgotten; let the others stop"
)
VEHICLE_ON_GROUND = "take off first: setpoints are flown only in the air"
