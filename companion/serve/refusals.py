"""Why control or a setpoint is refused, in words for the client."""

ENDING = "control is ending and the vehicle is held; request control again when it has ended"
FORGOTTEN = "too many programs send setpoints, and yours were forgotten; let the others stop"
ON_GROUND = "take off first: setpoints are flown only in the air"
