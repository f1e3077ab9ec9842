"""The typed configuration: its sections, its files, and the values derived for a vehicle."""

from companion.config.root import Config

__all__ = ["Config"]
