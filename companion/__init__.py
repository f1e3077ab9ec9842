"""MAVLink offboard companion: body rates under which horizontal acceleration answers linearly."""
