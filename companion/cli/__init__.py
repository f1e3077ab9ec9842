"""The commands, one file each; `companion.cli.command_line` reads the command line for them."""
