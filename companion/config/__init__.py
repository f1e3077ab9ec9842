"""The typed configuration: its sections, its files, and what follows from them for a vehicle."""

from companion.config.root import Config

__all__ = ["Config"]
