"""The exit codes of commands."""

EXIT_OK = 0
EXIT_FLIGHT = 1
"""The flight failed, or gave no usable result."""
EXIT_USAGE = 2
"""The command line or the configuration is wrong."""
