"""Reading and writing the files that a user names, within bounds."""
