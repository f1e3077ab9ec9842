"""The commands, one file each; `companion.command_line` reads the command line for them."""
