"""One receiver driven step by step by one's own simulator."""

from ._canyon import LiveReceiver

__all__ = ["LiveReceiver"]
