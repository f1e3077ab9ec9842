"""The link through MAVSDK (`link.backend: mavsdk`); needs the extra `mavsdk`."""
