"""The exit codes of commands."""

EXIT_OK = 0
EXIT_FAILURE = 1
"""The flight or the command failed or gave no usable result, or `doctor` found something unsafe."""
EXIT_USAGE = 2
"""The command line or the configuration is wrong, or something that it names cannot be used."""
