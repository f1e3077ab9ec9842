"""What a command's end means to the shell."""

EXIT_OK = 0
EXIT_FLIGHT = 1
"""The flight failed, or nothing usable came of it."""
EXIT_USAGE = 2
"""The command line or the configuration is wrong."""
