"""The commands, one file each; `companion.cli.command_line` parses their options."""
