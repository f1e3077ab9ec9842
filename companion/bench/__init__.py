"""What this program costs, measured against others that do the same job."""
