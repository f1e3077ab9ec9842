"""Benchmarks: latency and processor time, compared with other programs; speed in one process."""
