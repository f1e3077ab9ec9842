"""Benchmarks of latency, processor time, planners and whole flights, with comparisons."""
