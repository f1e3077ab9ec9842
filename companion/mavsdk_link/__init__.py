"""The link by way of MAVSDK, for those whose stack it is; needs the extra `mavsdk`."""
