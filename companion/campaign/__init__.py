"""Campaigns: many flights or batches over swept keys, on many processes and computers."""
