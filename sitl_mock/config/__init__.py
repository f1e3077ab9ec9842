"""What can be set: typed sections, and the reading of their YAML."""
