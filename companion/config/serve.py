"""Other programs on our link: where they connect, and what they may do."""

from typing import Annotated

from pydantic import Field

from companion.files.yaml_file import Section

_Endpoint = Annotated[str, Field(max_length=300)]
_Name = Annotated[str, Field(min_length=1, max_length=300)]


class ServeConfig(Section):
    """`companion serve`: other programs on our link."""

    clients: Annotated[tuple[_Endpoint, ...], Field(max_length=32)] = (
        "udpout://127.0.0.1:14550",
        "udpin://127.0.0.1:14551",
    )
    """Where clients connect, in the notation of link.endpoint. udpin and tcpin take any number of
    clients. The defaults reach a ground station on this computer, and take programs at 14551."""
    trusted: Annotated[tuple[_Name, ...], Field(max_length=100)] = ()
    """IP addresses and serial devices that may command without signing. Clients on this computer
    always may; all others only read."""
