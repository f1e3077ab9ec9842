"""The same link through MAVSDK, for users of its stack; needs the extra `mavsdk`."""
