"""Benchmarks: latency and processor time of this program beside others, and speed in memory."""
