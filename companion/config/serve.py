"""Other programs on our link: their endpoints and permissions."""

from typing import Annotated

from pydantic import Field

from companion.config.units import Si
from companion.files.yaml_file import Section

_Endpoint = Annotated[str, Field(max_length=300)]
_Name = Annotated[str, Field(min_length=1, max_length=300)]


class ServeConfig(Section):
    """`companion serve`: other programs on our link, and control by their setpoints."""

    clients: Annotated[tuple[_Endpoint, ...], Field(max_length=32)] = (
        "udpout://127.0.0.1:14550",
        "udpin://127.0.0.1:14551",
    )
    """Endpoints for clients, in the notation of link.endpoint. udpin and tcpin take any number of
    clients. The defaults send to a ground station on this computer, and accept programs at port
    14551.
    """
    trusted: Annotated[tuple[_Name, ...], Field(max_length=100)] = ()
    """IP addresses and serial devices that may command without signing. Clients on this computer
    may always command. All other clients may only read, unless they sign with the vehicle's key.
    """
    control: bool = True
    """Fly the setpoints of clients (extra `serve`). false: pass them on like all other messages."""
    setpoint_timeout_ms: Annotated[float, Field(ge=100.0, le=2000.0)] = 500.0
    """Longest time between setpoints of a client. After a longer time the program makes the
    vehicle hold."""
    hold_s: Annotated[float, Field(ge=0.0, le=600.0)] = 5.0
    """Duration of the hold after a client's setpoints stop. Then the vehicle is handed back."""
    max_speed_m_s: Annotated[float, Field(ge=0.1, le=30.0)] = 5.0
    """Largest horizontal speed towards a commanded position. A commanded velocity, its vertical
    part included, may reach 0.9 of safety.max_speed_m_s."""
    max_acceleration_m_s2: Annotated[float, Field(ge=0.1, le=15.0)] = 3.0
    """Largest horizontal acceleration after a jump of the commanded position or velocity."""
    max_jerk_m_s3: Annotated[float, Field(ge=1.0, le=100.0)] = 8.0
    """Largest horizontal jerk after a jump of the commanded position or velocity. The jerk
    divided by gravity is the tilt rate in rad/s."""

    setpoint_timeout = Si("setpoint_timeout_ms")
