"""The commands, one file each; `companion.cli` reads the command line for them."""
