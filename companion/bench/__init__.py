"""Benchmarks: latency and processor time of this program, compared with others."""
